//! Lines of text files.

use super::error::Fault;

/// A line of words, with its number for messages.
pub(super) struct Line<'a> {
    pub number: usize,
    pub text: &'a str,
}

impl<'a> Line<'a> {
    pub fn fault(&self, problem: impl Into<String>) -> Fault {
        Fault::new(format!("line {}", self.number), problem)
    }

    /// A number, or a fault that shows the word.
    pub fn float(&self, word: &str) -> Result<f32, Fault> {
        word.parse().map_err(|_| self.fault(format!("'{}' is not a number", shortened(word))))
    }

    /// The first `N` words after the keyword as numbers.
    pub fn floats<const N: usize>(&self, words: &[&'a str]) -> Result<[f32; N], Fault> {
        let Some(words) = words.get(..N) else {
            return Err(self.fault(format!("{} numbers, expected {N}", words.len())));
        };
        let mut numbers = [0.0; N];
        for (number, word) in numbers.iter_mut().zip(words) {
            *number = self.float(word)?;
        }
        Ok(numbers)
    }
}

/// Words of a broken file can be long.
pub(super) fn shortened(word: &str) -> String {
    let mut short: String = word.chars().take(40).collect();
    if short.len() < word.len() {
        short.push('…');
    }
    short
}

//! Which light to draw: by flux, and among lamps by what each sends to the place that is lit.

use super::distribution::{Choice, Discrete};

/// Share of a lamp's probability that is the same everywhere: what it sends is only estimated, by its middle and without
/// obstacles.
const EVERYWHERE: f64 = 0.25;

/// Probabilities of lights, lamps first.
#[derive(Clone, Debug)]
pub(super) struct LightChoice {
    everywhere: Discrete,
    lamps: usize,
    /// Probability of all lamps together, the same everywhere.
    lamps_share: f64,
}

impl LightChoice {
    /// From the lights' weights, of which the first `lamps` are lamps'. `None` as for [`Discrete::new`].
    pub fn new(weights: Vec<f64>, lamps: usize) -> Option<Self> {
        let everywhere = Discrete::new(weights)?;
        let lamps_share = (0..lamps).map(|lamp| everywhere.probability(lamp)).sum();
        Some(Self { everywhere, lamps, lamps_share })
    }

    /// Draws a light for any place.
    pub fn sample_everywhere(&self, u: f32) -> Choice {
        self.everywhere.sample(u)
    }

    /// Draws a light for the place at which `sent` estimates what a lamp sends there.
    pub fn sample(&self, u: f32, sent: impl Fn(usize) -> f32) -> Choice {
        let total = self.total(&sent);
        let mut below = 0.0;
        for index in 0..self.lamps {
            let probability = self.of_lamp(index, &sent, total);
            if probability > 0.0 && f64::from(u) < below + probability {
                let rest = ((f64::from(u) - below) / probability) as f32;
                return Choice { index, probability, rest: rest.clamp(0.0, 1.0 - f32::EPSILON / 2.0) };
            }
            below += probability;
        }
        self.everywhere.sample(u)
    }

    /// Of [`LightChoice::sample`] yielding a light.
    pub fn probability(&self, light: usize, sent: impl Fn(usize) -> f32) -> f64 {
        if light < self.lamps {
            self.of_lamp(light, &sent, self.total(&sent))
        } else {
            self.everywhere.probability(light)
        }
    }

    fn total(&self, sent: impl Fn(usize) -> f32) -> f64 {
        (0..self.lamps).map(|lamp| f64::from(sent(lamp))).sum()
    }

    fn of_lamp(&self, lamp: usize, sent: impl Fn(usize) -> f32, total: f64) -> f64 {
        let everywhere = self.everywhere.probability(lamp);
        if total > 0.0 && total.is_finite() {
            let here = self.lamps_share * f64::from(sent(lamp)) / total;
            EVERYWHERE * everywhere + (1.0 - EVERYWHERE) * here
        } else {
            everywhere
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two lamps and two other lights, of which the second lamp has no power: drawn as often as their probabilities say, which
    /// sum to 1.
    #[test]
    fn lights_are_drawn_by_their_probabilities() {
        let choice = LightChoice::new(vec![3.0, 0.0, 2.0, 5.0, 10.0], 3).unwrap();
        for sent in [[1.0, 0.0, 4.0], [0.0; 3], [f32::INFINITY, 0.0, 1.0]] {
            let mut drawn = [0; 5];
            const COUNT: u32 = 1 << 16;
            for step in 0..COUNT {
                let found = choice.sample((step as f32 + 0.5) / COUNT as f32, |lamp| sent[lamp]);
                assert_eq!(found.probability, choice.probability(found.index, |lamp| sent[lamp]));
                drawn[found.index] += 1;
            }
            let probabilities: Vec<f64> =
                (0..5).map(|light| choice.probability(light, |lamp| sent[lamp])).collect();
            assert!((probabilities.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            for (drawn, probability) in drawn.into_iter().zip(probabilities) {
                // Each interval is cut off by less than a step at either end.
                assert!((f64::from(drawn) - probability * f64::from(COUNT)).abs() <= 2.0);
            }
        }
        // What is sent shifts the lamps' share, not that of the others: ¼ · 3/20 + ¾ · 5/20 · 1/5.
        let probability = choice.probability(0, |lamp| [1.0, 0.0, 4.0][lamp]);
        assert!((probability - (0.25 * 3.0 / 20.0 + 0.75 * 0.25 * 0.2)).abs() < 1e-12);
    }
}

//! Folders laid out like the TUM RGB-D benchmark: lists of files and times, and the true trajectory.
//!
//! Sturm, Engelhard, Endres, Burgard, Cremers: A benchmark for the evaluation of RGB-D SLAM systems (IROS 2012).

use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::clock::Timestamp;

/// Metres a count of the benchmark's depth images.
pub const DEPTH_UNIT_M: f64 = 1.0 / 5000.0;

/// A file of a stream and when it was taken.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TumFile {
    /// When it was taken; the zero is the benchmark's (1970).
    pub stamp: Timestamp,
    /// The image.
    pub path: PathBuf,
}

/// A line of `groundtruth.txt`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TumPose {
    /// When the camera was there.
    pub stamp: Timestamp,
    /// Where the camera was, in metres: the translation of world_from_camera.
    pub position_m: [f64; 3],
    /// How it was turned: the unit quaternion `[x, y, z, w]` of world_from_camera.
    pub rotation_xyzw: [f64; 4],
}

/// What cannot be read of a TUM folder.
#[derive(Debug, thiserror::Error)]
pub enum TumError {
    /// A list is missing or unreadable.
    #[error("{}: cannot be read: {error}", path.display())]
    Unreadable {
        /// The list.
        path: PathBuf,
        /// What the system says.
        error: std::io::Error,
    },
    /// A line is not what it should be.
    #[error("{}, line {line}: {reason}", path.display())]
    Line {
        /// The list.
        path: PathBuf,
        /// Which line, from 1.
        line: usize,
        /// What is wrong and what should be there.
        reason: String,
    },
}

/// Reads `rgb.txt` or `depth.txt`: a time in seconds and a file name a line, `#` begins a comment. In order of time.
///
/// # Errors
/// [`TumError`] names file and line.
pub fn read_files(list: &Path) -> Result<Vec<TumFile>, TumError> {
    let folder = list.parent().unwrap_or(Path::new("."));
    let mut files = read_lines(list, |words| {
        let [stamp, name] = words else {
            return Err("a line has a time and a file name".into());
        };
        Ok(TumFile { stamp: parse_stamp(stamp)?, path: folder.join(name) })
    })?;
    files.sort_by_key(|file| file.stamp);
    Ok(files)
}

/// Reads `groundtruth.txt`: `time tx ty tz qx qy qz qw` a line. In order of time, quaternions normalised.
///
/// # Errors
/// [`TumError`] names file and line.
pub fn read_poses(list: &Path) -> Result<Vec<TumPose>, TumError> {
    let mut poses = read_lines(list, |words| {
        let [stamp, numbers @ ..] = words else {
            return Err("an empty line".into());
        };
        let numbers: Vec<f64> = numbers.iter().map(|word| parse_number(word)).collect::<Result<_, _>>()?;
        let &[tx, ty, tz, qx, qy, qz, qw] = numbers.as_slice() else {
            return Err("a line has 8 numbers: time tx ty tz qx qy qz qw".into());
        };
        let length = [qx, qy, qz, qw].iter().map(|q| q * q).sum::<f64>().sqrt();
        if (length - 1.0).abs() > 0.01 {
            return Err(format!("the quaternion has length {length}, it must be 1"));
        }
        let rotation_xyzw = [qx, qy, qz, qw].map(|q| q / length);
        Ok(TumPose { stamp: parse_stamp(stamp)?, position_m: [tx, ty, tz], rotation_xyzw })
    })?;
    poses.sort_by_key(|pose| pose.stamp);
    Ok(poses)
}

/// Pairs of indices of stamps that belong together, as the benchmark's `associate.py` finds them: nearest pairs first,
/// each stamp in at most one pair, no pair further apart than `within`. Both lists are in order of time, so is the
/// result.
pub fn associate(first: &[Timestamp], second: &[Timestamp], within: Duration) -> Vec<(usize, usize)> {
    let mut candidates = Vec::new();
    let mut begin = 0;
    for (i, a) in first.iter().enumerate() {
        while second.get(begin).is_some_and(|b| a.saturating_since(*b) > within) {
            begin += 1;
        }
        for (j, b) in second.iter().enumerate().skip(begin) {
            if b.saturating_since(*a) > within {
                break;
            }
            candidates.push((a.signed_ns_since(*b).unsigned_abs(), i, j));
        }
    }
    candidates.sort_unstable();
    let (mut used_a, mut used_b) = (vec![false; first.len()], vec![false; second.len()]);
    let mut pairs: Vec<_> = candidates
        .into_iter()
        .filter(|&(_, i, j)| {
            let free = !used_a[i] && !used_b[j];
            if free {
                (used_a[i], used_b[j]) = (true, true);
            }
            free
        })
        .map(|(_, i, j)| (i, j))
        .collect();
    pairs.sort_unstable();
    pairs
}

fn read_lines<T>(
    path: &Path,
    mut parse: impl FnMut(&[&str]) -> Result<T, String>,
) -> Result<Vec<T>, TumError> {
    let text =
        std::fs::read_to_string(path).map_err(|error| TumError::Unreadable { path: path.into(), error })?;
    let mut items = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let words: Vec<&str> = line.split('#').next().unwrap_or_default().split_whitespace().collect();
        if !words.is_empty() {
            let item = parse(&words);
            items.push(item.map_err(|reason| TumError::Line {
                path: path.into(),
                line: number + 1,
                reason,
            })?);
        }
    }
    Ok(items)
}

fn parse_number(word: &str) -> Result<f64, String> {
    let number: Option<f64> = word.parse().ok();
    number.filter(|number| number.is_finite()).ok_or_else(|| format!("`{word}` is no number"))
}

/// Seconds as decimal text to nanoseconds: a float would lose a fifth of a microsecond since 1970.
fn parse_stamp(word: &str) -> Result<Timestamp, String> {
    let wrong = || format!("`{word}` is no time in seconds such as 1305031102.175304");
    let (seconds, fraction) = word.split_once('.').unwrap_or((word, ""));
    if seconds.is_empty() || !seconds.bytes().chain(fraction.bytes()).all(|byte| byte.is_ascii_digit()) {
        return Err(wrong());
    }
    let seconds: u64 = seconds.parse().map_err(|_| wrong())?;
    let digits = fraction.bytes().chain(std::iter::repeat(b'0')).take(9);
    let nanoseconds = digits.fold(0_u64, |value, digit| value * 10 + u64::from(digit - b'0'));
    let ns =
        seconds.checked_mul(1_000_000_000).and_then(|ns| ns.checked_add(nanoseconds)).ok_or_else(wrong)?;
    Ok(Timestamp::from_ns(ns))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_keep_their_nanoseconds() {
        assert_eq!(parse_stamp("1305031102.175304").unwrap().as_ns(), 1_305_031_102_175_304_000);
        assert_eq!(parse_stamp("3").unwrap().as_ns(), 3_000_000_000);
        assert_eq!(parse_stamp("0.0000000019").unwrap().as_ns(), 1);
        for wrong in ["", ".", "-1", "1e9", "1.2.3", "nan", "99999999999999"] {
            assert!(parse_stamp(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn nearest_pairs_win_and_nothing_is_used_twice() {
        let ms =
            |times: &[u64]| -> Vec<_> { times.iter().map(|t| Timestamp::from_ns(t * 1_000_000)).collect() };
        let within = Duration::from_millis(20);
        // 0 and 12 both want 10; 12 is nearer. 100 has nobody; 200 and 220 are just in reach.
        let pairs = associate(&ms(&[0, 12, 100, 200]), &ms(&[10, 50, 130, 220]), within);
        assert_eq!(pairs, [(1, 0), (3, 3)]);
        assert_eq!(associate(&ms(&[0]), &ms(&[21]), within), []);
        assert_eq!(associate(&[], &ms(&[1]), within), []);
    }
}

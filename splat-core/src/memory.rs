//! Memory, asked for before it is taken.

use crate::Error;

/// How much may still be taken, by an account of what is about to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    /// In bytes; the greatest number means that nobody counts.
    left: usize,
}

impl Budget {
    /// A budget of so many bytes; `usize::MAX` is without end.
    pub fn new(bytes: usize) -> Self {
        Self { left: bytes }
    }

    /// Bytes left.
    pub fn left(&self) -> usize {
        self.left
    }

    /// Whether anybody counts.
    pub fn is_limited(&self) -> bool {
        self.left != usize::MAX
    }

    /// Sets bytes aside for `what`; `help` says how less would do.
    ///
    /// # Errors
    /// [`Error::Memory`] if they are more than are left.
    pub fn take(&mut self, what: &'static str, bytes: usize, help: &'static str) -> Result<(), Error> {
        if bytes > self.left {
            return Err(Error::Memory { what, needed: bytes, left: Some(self.left), help });
        }
        if self.is_limited() {
            self.left -= bytes;
        }
        Ok(())
    }
}

/// So many equal values.
///
/// # Errors
/// [`Error::Memory`] where the system has no more.
pub fn filled<T: Clone>(
    what: &'static str,
    value: T,
    count: usize,
    help: &'static str,
) -> Result<Vec<T>, Error> {
    let mut values = Vec::new();
    let needed = count.saturating_mul(size_of::<T>());
    values.try_reserve_exact(count).map_err(|_| Error::Memory { what, needed, left: None, help })?;
    values.resize(count, value);
    Ok(values)
}

/// Bytes for people: in the largest of MB and GB that leaves a whole, rounded up to a tenth.
pub fn in_words(bytes: usize) -> String {
    let [megabytes, gigabytes] = [1 << 20, 1 << 30].map(|unit| bytes as f64 / f64::from(unit));
    let tenths = |value: f64| (value * 10.0).ceil() / 10.0;
    if gigabytes >= 1.0 {
        format!("{:.1} GB", tenths(gigabytes))
    } else {
        format!("{:.1} MB", tenths(megabytes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_budget_counts_down_and_says_what_it_lacks() {
        let mut budget = Budget::new(3 << 20);
        budget.take("one", 1 << 20, "less").unwrap();
        let refused = budget.take("another", 5 << 29, "take less").unwrap_err().to_string();
        assert_eq!(refused, "another needs 2.5 GB of memory, and 2.0 MB are left: take less");
        assert_eq!(budget.left(), 2 << 20);
        let mut endless = Budget::new(usize::MAX);
        endless.take("all", usize::MAX, "").unwrap();
        assert!(!endless.is_limited());
    }

    #[test]
    fn what_the_system_has_not_is_an_error() {
        let refused = filled("a wall", [0u8; 64], usize::MAX / 64, "a lower wall").unwrap_err().to_string();
        assert!(refused.contains("and the system has no more: a lower wall"), "{refused}");
        assert_eq!(filled("x", 7, 3, "").unwrap(), [7, 7, 7]);
    }
}

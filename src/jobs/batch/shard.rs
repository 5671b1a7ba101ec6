//! Shards: shard `I` of `N`, as given or as the cluster's array of tasks says.

use std::fmt;
use std::str::FromStr;

/// One of `count` equal shares of the units.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shard {
    /// From 1 to `count`.
    index: usize,
    count: usize,
}

impl Shard {
    /// All units.
    pub(crate) const ALL: Self = Self { index: 1, count: 1 };

    /// Returns whether the shard has the unit of this number, from 0 on. Neighbors go to different shards, so that the
    /// units of a large scene do not all fall into one.
    pub(crate) fn has(self, unit: usize) -> bool {
        unit % self.count == self.index - 1
    }

    /// Returns the shard of a task of a Slurm array from environment variables, which `variable` reads; `None` outside
    /// of an array.
    ///
    /// # Errors
    /// If the variables contradict one another.
    pub(crate) fn of_array(variable: impl Fn(&str) -> Option<String>) -> Result<Option<Self>, String> {
        let number = |name: &str| -> Result<Option<usize>, String> {
            let Some(text) = variable(name) else { return Ok(None) };
            text.trim().parse().map(Some).map_err(|_| format!("{name} is '{text}', not a number; give --shard I/N"))
        };
        let Some(task) = number("SLURM_ARRAY_TASK_ID")? else { return Ok(None) };
        let Some(count) = number("SLURM_ARRAY_TASK_COUNT")? else {
            return Err("SLURM_ARRAY_TASK_ID is set and SLURM_ARRAY_TASK_COUNT is not; give --shard I/N".into());
        };
        let least = number("SLURM_ARRAY_TASK_MIN")?.unwrap_or(1);
        let step = number("SLURM_ARRAY_TASK_STEP")?.unwrap_or(1).max(1);
        let place = task.checked_sub(least).filter(|past| past % step == 0).map(|past| past / step);
        match place {
            Some(place) if place < count => Ok(Some(Self { index: place + 1, count })),
            _ => Err(format!(
                "task {task} of an array of {count} from {least} in steps of {step}: the tasks are no even range, so \
                 their shares are unknown; use one such as --array=1-{count}, or give --shard I/N"
            )),
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').and_then(|(i, n)| Some((i.trim().parse().ok()?, n.trim().parse().ok()?)));
        match numbers {
            Some((index, count)) if (1..=count).contains(&index) => Ok(Self { index, count }),
            _ => Err("a shard I/N is needed, with I from 1 to N, such as 1/4".into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_unit_is_in_exactly_one_shard() {
        for count in 1..=40 {
            let shards: Vec<Shard> = (1..=count).map(|i| format!("{i}/{count}").parse().expect("a shard")).collect();
            for unit in 0..100 {
                assert_eq!(shards.iter().filter(|s| s.has(unit)).count(), 1, "{unit} of {count}");
            }
            // Shares differ by one unit at most.
            let sizes: Vec<usize> = shards.iter().map(|s| (0..100).filter(|u| s.has(*u)).count()).collect();
            assert!(sizes.iter().max() <= sizes.iter().min().map(|n| n + 1).as_ref(), "{sizes:?}");
        }
        assert!((0..100).all(|unit| Shard::ALL.has(unit)));
    }

    #[test]
    fn slips_are_refused() {
        for bad in ["", "1", "0/4", "5/4", "1/0", "0/0", "-1/4", "1/4/2", "a/b", "1.5/2", "99999999999999999999/1"] {
            assert!(bad.parse::<Shard>().is_err(), "{bad}");
        }
        assert_eq!(" 2 / 3 ".parse::<Shard>().expect("spaces").to_string(), "2/3");
    }

    #[test]
    fn tasks_of_an_array_share_all_units() {
        let of = |values: [Option<&str>; 4]| {
            Shard::of_array(|name| {
                let names = ["ID", "COUNT", "MIN", "STEP"];
                let k = names.iter().position(|n| name == format!("SLURM_ARRAY_TASK_{n}")).expect("known");
                values[k].map(str::to_owned)
            })
        };
        assert_eq!(of([None; 4]), Ok(None));
        for (least, step, count) in [(0_usize, 1, 4_usize), (1, 1, 4), (10, 5, 3), (3, 1, 1)] {
            let task = |k: usize| {
                let [id, count, least, step] = [least + k * step, count, least, step].map(|n| n.to_string());
                of([Some(&id), Some(&count), Some(&least), Some(&step)]).expect("even").expect("an array").to_string()
            };
            let all: Vec<String> = (0..count).map(task).collect();
            assert_eq!(all, (1..=count).map(|i| format!("{i}/{count}")).collect::<Vec<_>>());
        }
        // --array=3,7: two tasks, of which the second would be the fifth of two.
        for bad in [
            [Some("7"), Some("2"), Some("3"), Some("1")],
            [Some("2"), Some("2"), Some("3"), Some("1")],
            [Some("4"), Some("3"), Some("1"), Some("2")],
            [Some("1"), None, None, None],
            [Some("x"), Some("2"), None, None],
        ] {
            assert!(of(bad).expect_err("uneven").contains("--shard"), "{bad:?}");
        }
    }
}

//! The script of a Slurm array in which every task runs a shard.

use std::path::Path;

use crate::jobs::JobError;

/// Most tasks of an array that a cluster takes by default (MaxArraySize is 1001).
const MOST_TASKS: usize = 1000;
/// Seconds before the time limit at which a task is asked to stop.
const STOP_SECS: u32 = 180;

/// Parts of an array's script.
pub(crate) struct ArrayScript<'a> {
    pub(crate) program: &'a Path,
    pub(crate) file: &'a Path,
    /// The command's other arguments.
    pub(crate) arguments: &'a [String],
    pub(crate) units: usize,
    /// Number of tasks; one per unit if `None`.
    pub(crate) tasks: Option<usize>,
    /// Exit code of a shard that was stopped and can be resumed.
    pub(crate) stopped: u8,
}

/// Returns the script, to be given to `sbatch`.
///
/// # Errors
/// If a path or an argument cannot stand in it.
pub(crate) fn script(of: &ArrayScript<'_>) -> Result<String, JobError> {
    let tasks = of.tasks.unwrap_or(of.units).clamp(1, MOST_TASKS);
    let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.into());
    let words = [absolute(of.program), absolute(of.file)].map(|p| p.to_str().map(str::to_owned));
    let [Some(program), Some(file)] = words else {
        let text = format!("{}: a path that is no Unicode cannot stand in a script", of.file.display());
        return Err(JobError::Batch(text));
    };
    let mut command = vec![quoted(&program)?, "batch".into(), quoted(&file)?];
    for argument in of.arguments {
        command.push(quoted(argument)?);
    }
    let (command, stopped) = (command.join(" "), of.stopped);
    Ok(format!(
        r#"#!/bin/bash
# {units} units in {tasks} tasks. What the cluster wants to know besides goes here or to the command line of sbatch:
# --partition, --account, --gres=gpu:1, --cpus-per-task, --mem, --time. A unit needs not fit into the time.
#SBATCH --job-name=fmlgs-batch
#SBATCH --array=1-{tasks}
#SBATCH --ntasks=1
# A task whose node fails is queued again, and one that is near its time limit is asked to stop.
#SBATCH --requeue
#SBATCH --signal=USR1@{STOP_SECS}
# Output of all attempts of a task, in one file.
#SBATCH --open-mode=append
#SBATCH --output=fmlgs-batch-%A_%a.log

# srun does not take over how many processors sbatch was asked for.
[ -z "${{SLURM_CPUS_PER_TASK:-}}" ] || export SRUN_CPUS_PER_TASK="$SLURM_CPUS_PER_TASK"
# The shard is what SLURM_ARRAY_TASK_ID and its like say.
srun {command}
code=$?

# {stopped}: stopped with a checkpoint. Whoever canceled the job wants no more of it: only a running one is queued again.
task=${{SLURM_ARRAY_JOB_ID}}_$SLURM_ARRAY_TASK_ID
if [ "$code" -eq {stopped} ] && [ "$(squeue --noheader --job "$task" --format %T)" = RUNNING ]; then
    scontrol requeue "$task" && exit 0
fi
exit "$code"
"#,
        units = of.units
    ))
}

/// Quotes a word for the shell.
fn quoted(word: &str) -> Result<String, JobError> {
    if word.contains(char::is_control) {
        let text = format!("'{}' has a control character in it and cannot stand in a script", word.escape_debug());
        return Err(JobError::Batch(text));
    }
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-=+,:@%".contains(c);
    Ok(if !word.is_empty() && word.chars().all(plain) {
        word.into()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_reach_the_program_as_they_are() {
        for word in ["plain", "", "two words", "it's", "$HOME `id` \"x\" \\", "*?[a]", "~", "-x", "ü"] {
            let script = format!("printf %s {}", quoted(word).expect("a word"));
            let said = std::process::Command::new("sh").args(["-c", &script]).output().expect("sh");
            assert_eq!(String::from_utf8_lossy(&said.stdout), word);
        }
        assert!(quoted("a\nb").is_err());
    }
}

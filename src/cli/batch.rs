//! `fmlgs batch`: scenes, settings and seeds, each with each, on as many machines as there are.

use std::path::{Path, PathBuf};
use std::time::Duration;

use serde_json::json;

use super::plan::PlanArgs;
use super::progress::Console;
use super::train::TrainOverrides;
use super::{CliError, STOPPED, eval, number, output, preprocess, table_args};
use crate::jobs::batch::{
    self, ArrayScript, BatchFile, BatchOutcome, BatchRequest, BatchTraining, Shard, TableReaders, UnitState,
};
use crate::jobs::presets;
use crate::math::format::things;

/// Train many scenes with many settings and seeds, on many machines
///
/// The file names scenes, settings (by the names that 'fmlgs train' has for them) and seeds; each combination is a unit
/// with a folder of its own, OUT/SCENE/SETTING/seed-N. A unit is trained and compared with the photos that were held
/// out; objects are found and compared with labels where the file says so. It is done when its result.json is there.
///
/// The same command run again, on any machine that has the files, goes on: what is done is skipped, what was stopped
/// continues at its checkpoint, what a dead process left is taken over. Ctrl-C, SIGTERM and SIGUSR1 save a
/// checkpoint and end the command with exit code 99: run it again.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs batch jobs.toml --dry-run              what there is to do\n  \
    fmlgs batch jobs.toml --out runs/            all of it, here\n  \
    fmlgs batch jobs.toml --out runs/ --shard 1/4    a quarter of it\n  \
    fmlgs batch jobs.toml --out runs/ --print-sbatch=8 > batch.sh    an array of 8 tasks for Slurm\n  \
    fmlgs report merge runs/                     one page of all results\n\n\
    A file:\n  \
    seeds = [0, 1, 2]\n\n  \
    [[scene]]\n  \
    path = \"data/garden\"          # relative to the file; also: name, masks (labels), query\n\n  \
    [[setting]]\n  \
    name = \"fast\"\n  \
    steps = 2000                  # as 'fmlgs train --steps 2000'; also: preset, plan = [\"photos=full\"]\n\n  \
    [objects]                     # to find objects, as 'fmlgs preprocess'; may be empty\n\n  \
    [eval]                        # as 'fmlgs eval': max-side, keep-borders, protocol, recipe and so on")]
pub(crate) struct BatchArgs {
    /// File of scenes, settings and seeds
    jobs: PathBuf,
    /// Folder of the results [default: as the file says ('out'), else out/NAME, the name of the file]
    #[arg(long)]
    out: Option<PathBuf>,
    /// The units of this shard only, I from 1 to N [default: that of the task of a Slurm array, else all]
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Try units again that failed
    #[arg(long)]
    retry_failed: bool,
    /// Seconds without a heartbeat after which a unit of another machine is taken over
    #[arg(long, default_value_t = 120.0, value_parser = number::within(1.0..=86_400.0))]
    takeover_secs: f64,
    /// List the units and where each stands, and run nothing
    #[arg(long)]
    dry_run: bool,
    /// Print the script of a Slurm array with so many tasks [default: one for each unit], and run nothing
    #[arg(long, value_name = "TASKS", require_equals = true, conflicts_with_all = ["shard", "dry_run", "json"],
        value_parser = number::within(1..=1_000_000_usize))]
    print_sbatch: Option<Option<usize>>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

/// Keys of a table `[[setting]]`.
#[derive(Debug, clap::Args)]
struct TrainingTable {
    #[command(flatten)]
    settings: TrainOverrides,
    #[command(flatten)]
    plan: PlanArgs,
    #[arg(long)]
    preset: Option<PathBuf>,
}

fn training(table: &toml::Table, folder: &Path) -> Result<BatchTraining, String> {
    if table.contains_key("seed") {
        return Err("'seed': seeds are for all settings; put them at the top: seeds = [0, 1]".into());
    }
    let table: TrainingTable = table_args::parse("train", table, &[], &["seed"])?;
    let base = table.preset.as_ref().map(|preset| presets::read(&folder.join(preset))).transpose();
    let config = table.settings.over(base.map_err(|e| format!("'preset': {e}"))?.unwrap_or_default());
    Ok(BatchTraining { config, plan: table.plan.overrides() })
}

const READERS: TableReaders = TableReaders { training, objects: preprocess::of_table, eval: eval::of_table };

impl BatchArgs {
    fn request(&self) -> Result<BatchRequest, CliError> {
        let batch = BatchFile::read(&self.jobs, READERS)?;
        let usual = || Path::new("out").join(self.jobs.file_stem().unwrap_or_default());
        let out = self.out.clone().or_else(|| batch.out.clone()).unwrap_or_else(usual);
        let shard = match self.shard {
            Some(shard) => shard,
            None => Shard::of_array(|name| std::env::var(name).ok()).map_err(CliError::Usage)?.unwrap_or(Shard::ALL),
        };
        let takeover = Duration::from_secs_f64(self.takeover_secs);
        Ok(BatchRequest { batch, out, shard, retry_failed: self.retry_failed, takeover })
    }

    fn script(&self, tasks: Option<usize>) -> Result<(), CliError> {
        let request = self.request()?;
        let absolute = std::path::absolute(&request.out)?;
        let Some(out) = absolute.to_str() else {
            return Err(CliError::failed("--out: a path that is no Unicode cannot stand in a script"));
        };
        let mut arguments = vec!["--out".to_owned(), out.to_owned()];
        arguments.extend(self.retry_failed.then(|| "--retry-failed".to_owned()));
        arguments.extend(["--takeover-secs".to_owned(), self.takeover_secs.to_string()]);
        let (units, program) = (batch::count(&request.batch), std::env::current_exe()?);
        let (file, arguments) = (&self.jobs, &arguments);
        let of = ArrayScript { program: &program, file, arguments, units, tasks, stopped: STOPPED };
        output::print(batch::script(&of)?.trim_end())
    }
}

pub(crate) fn run(args: BatchArgs, quiet: bool) -> Result<(), CliError> {
    if let Some(tasks) = args.print_sbatch {
        return args.script(tasks);
    }
    let request = args.request()?;
    if args.dry_run {
        return list(&request, args.json);
    }
    let (shard, all) = (request.shard, batch::count(&request.batch));
    if !(0..all).any(|unit| shard.has(unit)) {
        let text = format!("--shard: there is nothing in shard {shard}, the batch has {}", things(all, "unit"));
        return Err(CliError::Usage(text));
    }
    let outcome = batch::run(&request, &mut Console::new(quiet))?;
    let BatchOutcome { units, done, failed, elsewhere, stopped } = &outcome;
    if args.json {
        let named = |all: &[(String, String)], what: &str| -> Vec<serde_json::Value> {
            all.iter().map(|(unit, why)| json!({ "unit": unit, what: why })).collect()
        };
        output::print_json(&json!({
            "out": request.out, "shard": shard.to_string(), "units": units, "done": done, "stopped": stopped,
            "failed": named(failed, "error"), "elsewhere": named(elsewhere, "by"),
        }))?;
    } else {
        failed.iter().for_each(|(unit, why)| output::note(&format!("failed: {unit}: {why}")));
        elsewhere.iter().for_each(|(unit, by)| output::note(&format!("left to {by}: {unit}")));
        output::print(&format!("shard {shard}: {done} of {} done", things(*units, "unit")))?;
    }
    let left = request.out.display();
    if *stopped {
        return Err(CliError::Stopped(format!(
            "what was done is saved in {left}; the same command goes on from there"
        )));
    }
    if !failed.is_empty() {
        let (failed, file) = (things(failed.len(), "unit"), "failed.json in their folders");
        return Err(CliError::failed(format!("{failed} failed ({file} in {left}); --retry-failed tries again")));
    }
    Ok(())
}

fn list(request: &BatchRequest, as_json: bool) -> Result<(), CliError> {
    let units = batch::list(request)?;
    let told = |state: &UnitState| match state {
        UnitState::Waiting => ("waiting", String::new()),
        UnitState::Begun => ("begun", String::new()),
        UnitState::Held(by) => ("held", by.clone()),
        UnitState::Done => ("done", String::new()),
        UnitState::Failed(why) => ("failed", why.clone()),
        UnitState::Changed(what) => ("changed", what.clone()),
    };
    if as_json {
        let unit = |(name, state): &(String, UnitState)| {
            let (state, text) = told(state);
            json!({ "unit": name, "state": state, "text": text })
        };
        let units: Vec<_> = units.iter().map(unit).collect();
        return output::print_json(&json!({
            "out": request.out, "shard": request.shard.to_string(), "units": units,
        }));
    }
    let mut lines = vec![format!("{} in shard {}:", things(units.len(), "unit"), request.shard)];
    lines.extend(units.iter().map(|(name, state)| {
        let (state, text) = told(state);
        format!("{state:<8} {name}{}", if text.is_empty() { text } else { format!(": {text}") })
    }));
    output::print(&lines.join("\n"))
}

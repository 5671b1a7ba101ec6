//! The observer of the command line: a progress bar on a terminal, a line now and then elsewhere.
//! Everything goes to standard error, so that standard output holds results alone.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{HumanCount, HumanDuration, ProgressBar, ProgressStyle};

use super::{interrupt, output};
use crate::pipeline::observer::{Evaluation, Observer, Progress, Severity, Signal, StepMetrics};
use crate::scene::text;

/// Time between lines where standard error is no terminal.
const LINE_INTERVAL: Duration = Duration::from_secs(5);

/// Shows work to a user at a terminal or reading a log.
pub(crate) struct Console {
    quiet: bool,
    terminal: bool,
    bar: Option<(String, ProgressBar)>,
    metrics: String,
    last_line: Instant,
}

impl Console {
    /// `quiet` shows warnings only.
    pub(crate) fn new(quiet: bool) -> Self {
        let terminal = std::io::stderr().is_terminal();
        Self { quiet, terminal, bar: None, metrics: String::new(), last_line: Instant::now() }
    }

    /// Prints a line without disturbing the bar.
    fn line(&self, text: &str) {
        match &self.bar {
            Some((_, bar)) => bar.suspend(|| output::note(text)),
            None => output::note(text),
        }
    }

    /// The bar of `stage`, a new one if the stage has changed; without numbers if nothing counts its steps.
    fn bar(&mut self, stage: &str, counts: bool) -> &ProgressBar {
        if self.bar.as_ref().is_none_or(|(current, _)| current != stage) {
            if let Some((_, old)) = self.bar.take() {
                old.finish_and_clear();
            }
            self.metrics.clear();
            let bar = ProgressBar::new(0);
            let counted = if counts { " [{bar:28}] {human_pos}/{human_len}" } else { "\u{2026}" };
            let style = ProgressStyle::with_template(&format!("{{prefix}}{counted} {{msg}}"));
            if let Ok(style) = style {
                bar.set_style(style.progress_chars("=> "));
            }
            bar.set_prefix(text::line(stage).into_owned());
            return &self.bar.insert((stage.to_owned(), bar)).1;
        }
        &self.bar.get_or_insert_with(|| (stage.to_owned(), ProgressBar::hidden())).1
    }
}

impl Observer for Console {
    fn signal(&self) -> Signal {
        if interrupt::asked_to_stop() { Signal::Cancel } else { Signal::Continue }
    }

    fn progress(&mut self, progress: Progress) {
        if self.quiet {
            return;
        }
        if self.terminal {
            let message = format!("{} {}", rate_and_times(&progress), self.metrics);
            let counts = progress.total > 0;
            let bar = self.bar(&progress.stage, counts);
            bar.set_length(progress.total);
            bar.set_position(progress.done);
            bar.set_message(message);
            if counts && progress.done >= progress.total {
                bar.finish_and_clear();
            }
            return;
        }
        if self.last_line.elapsed() >= LINE_INTERVAL {
            self.last_line = Instant::now();
            let (done, total) = (HumanCount(progress.done), HumanCount(progress.total));
            let counted = if progress.total > 0 {
                format!("{done}/{total} {}", rate_and_times(&progress))
            } else {
                String::new()
            };
            output::note(format!("{} {counted} {}", progress.stage, self.metrics).trim_end());
        }
    }

    fn step(&mut self, m: StepMetrics) {
        let gaussians = HumanCount(m.gaussians as u64);
        self.metrics = format!("| loss {:.4} PSNR {:.2} dB, {gaussians} Gaussians", m.loss, m.train_psnr);
    }

    fn evaluation(&mut self, e: Evaluation) {
        if !self.quiet {
            self.line(&e.line());
        }
    }

    fn note(&mut self, severity: Severity, text: String) {
        match severity {
            Severity::Warning => self.line(&format!("warning: {text}")),
            Severity::Info if !self.quiet => self.line(&text),
            Severity::Info => {}
        }
    }
}

impl Drop for Console {
    fn drop(&mut self) {
        if let Some((_, bar)) = self.bar.take() {
            bar.finish_and_clear();
        }
    }
}

fn rate_and_times(p: &Progress) -> String {
    let duration = |secs: f64| HumanDuration(Duration::try_from_secs_f64(secs).unwrap_or_default());
    let elapsed = duration(p.elapsed_secs);
    match p.eta_secs() {
        Some(eta) if p.done < p.total => format!("{:.1}/s, {elapsed:#}, ETA {:#}", p.rate, duration(eta)),
        _ => format!("{elapsed:#}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_gives_an_eta() {
        let mut p = Progress { stage: "Training".into(), done: 50, total: 200, elapsed_secs: 10.0, rate: 5.0 };
        assert_eq!(rate_and_times(&p), "5.0/s, 10s, ETA 30s");
        p.rate = 0.0;
        assert_eq!(rate_and_times(&p), "10s");
        p.elapsed_secs = f64::NAN;
        assert!(!rate_and_times(&p).is_empty());
    }
}

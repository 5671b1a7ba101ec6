//! Protocols that compare objects and parts with labels.

/// Protocol of comparing objects and parts with labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Protocol {
    /// The pixels of the answer against the region, IoU; objects and parts apart
    Masks,
    /// LERF-OVS as LangSplat counts it: smoothed relevancy cut at 0.4, and localization
    Langsplat,
    /// What true labels would reach with the same Gaussians, and what the answers lose, by cause
    Limits,
    /// FastLGS's evaluator, with its running pooled IoU; for comparison with published numbers only
    FastlgsEx,
    /// Gaussians chosen by text, their silhouette cut at 0.7 (OpenGaussian)
    #[value(name = "3d-selection")]
    Selection3d,
    /// One foreground object at 1008 x 567: IoU and accuracy
    SpinNerf,
    /// Every class: own masks, and the arg-max over all
    #[value(name = "3d-ovs")]
    Ovs3d,
    /// Part queries by embedding alone, with the paper's components switched on one after another
    PartRecall,
    /// Things found and rightly not found, by names, embeddings and both, by each strategy and rule
    Recipes,
    /// Things selected by strokes in the view that shows most of them, judged in all other views
    Strokes,
    /// Known things, corrected by strokes in the views where most is wrong, judged in all of them
    Corrections,
}

impl Protocol {
    /// Returns its name on the command line.
    pub(crate) fn name(self) -> String {
        clap::ValueEnum::to_possible_value(&self).map_or_else(String::new, |v| v.get_name().to_owned())
    }

    /// Returns whether the mean over all queries has a meaning.
    pub(crate) fn has_units(self) -> bool {
        !matches!(self, Self::Limits | Self::PartRecall | Self::Recipes | Self::Strokes | Self::Corrections)
    }
}

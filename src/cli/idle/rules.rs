//! Rules of what does nothing, command by command. What the data decide is checked where they are read.

use super::{Given, Rule};

/// The options of [`crate::cli::recipe::RecipeArgs`].
pub(super) const RECIPE: &[&str] = &[
    "recipe",
    "by",
    "strategy",
    "deviation",
    "canonical",
    "temperature",
    "relevancy",
    "matching",
    "blend",
    "tolerance",
    "not_found",
];
/// Options of training ([`crate::cli::train::TrainOverrides`]).
const TRAINING: &[&str] = &[
    "steps",
    "max_side",
    "held_out_every",
    "sh_degree",
    "sh_at_once",
    "coarse_share",
    "no_densify",
    "max_gaussians",
    "random_points",
    "antialias",
    "no_antialias",
    "seed",
    "eval_every",
    "checkpoint_secs",
    "backend",
    "surfels",
    "normal_weight",
    "distortion_weight",
    "refine_poses",
    "exposure",
];

const fn rule(
    commands: &'static [&'static str],
    options: &'static [&'static str],
    idle: fn(&Given<'_>) -> Option<&'static str>,
) -> Rule {
    Rule { commands, options, idle }
}

/// The reason where `is` holds.
fn when(is: bool, why: &'static str) -> Option<&'static str> {
    is.then_some(why)
}

/// Returns whether the recipe is the paper's.
fn is_paper(g: &Given<'_>) -> bool {
    g.is("recipe", "paper")
}

fn matches_codes(g: &Given<'_>) -> bool {
    g.has("blend") || g.is("matching", "codes") || (is_paper(g) && !g.has("matching"))
}

/// Returns whether a model tracks masks through the photos.
fn tracks(g: &Given<'_>) -> bool {
    if g.has("tracker") { !g.is("tracker", "geometry") } else { is_paper(g) }
}

fn lifts_by_votes(g: &Given<'_>) -> bool {
    if g.has("lifting") { g.is("lifting", "votes") } else { !is_paper(g) }
}

/// Returns whether masks come from no network.
fn without_network(g: &Given<'_>) -> bool {
    g.has("masks") || g.is("segmenter", "files") || g.is("segmenter", "regions")
}

/// Returns whether the output is a folder of frames, which are stored as they are: no encoder asks for a quality.
fn frames(g: &Given<'_>) -> bool {
    let out = g.texts("out").concat().to_lowercase();
    !["mp4", "m4v", "gif", "webp"].iter().any(|ending| out.ends_with(&format!(".{ending}")))
}

/// Returns whether only some stages are measured, and none of `these`.
fn without_stages(g: &Given<'_>, these: &[&str]) -> bool {
    g.has("stages") && !g.texts("stages").iter().flat_map(|s| s.split(',')).any(|s| these.contains(&s))
}

pub(super) const RULES: &[Rule] = &[
    // How questions are answered.
    rule(&["query", "segment", "eval", "batch eval", "agent", "mcp"], &["tolerance"], |g| {
        when(!matches_codes(g), "without --match codes")
    }),
    rule(
        &["query", "segment", "eval", "batch eval", "agent", "mcp"],
        &["deviation", "canonical", "temperature"],
        |g| when(g.is("by", "names"), "with --by names, which compares no embeddings"),
    ),
    rule(&["query"], &["relevancy"], |g| when(!g.has_any(&["heat", "out"]), "without --heat or --out")),
    rule(&["query"], &["arrays"], |g| when(!g.has("out"), "without --out")),
    rule(&["segment", "eval", "batch eval", "report"], &["relevancy"], |_| Some("here: no heat map is drawn")),
    rule(&["query"], &["views", "truth", "export"], |g| when(!g.has("phrases"), "without --phrases")),
    rule(&["query"], &["heat"], |g| {
        when(g.path("heat") == g.path("mask"), "on the file of --mask: give it a file of its own")
    }),
    rule(&["features"], &["embeddings"], |g| {
        when(
            g.has("codes") && g.path("embeddings") == g.path("codes"),
            "on the file of --codes: give it a file of its own",
        )
    }),
    // Objects as Gaussians.
    rule(&["segment"], &["format", "masks", "views", "max_side"], |g| when(!g.has("all"), "without --all")),
    rule(&["segment"], &["click_out", "view", "width", "correct", "keep", "part_of"], |g| {
        when(!g.has("click"), "without --click")
    }),
    rule(&["segment"], &["top", "kind"], |g| when(g.has("click"), "with --click, which asks for nothing")),
    rule(&["segment"], RECIPE, |g| when(g.has("click"), "with --click, which asks for nothing")),
    rule(&["segment"], &["no_measure"], |g| when(g.has("all"), "with --all, which measures nothing")),
    rule(&["segment"], &["no_measure"], |g| when(!g.has("out"), "without --out")),
    // Measures.
    rule(&["eval"], &["protocol", "query", "decoder", "encoder"], |g| when(!g.has("masks"), "without --masks")),
    rule(&["eval"], RECIPE, |g| {
        when(!g.has_any(&["masks", "questions"]), "without --masks or --questions: nothing is asked for")
    }),
    rule(&["eval", "batch eval"], RECIPE, |g| {
        let strokes = g.is("protocol", "strokes") || g.is("protocol", "corrections");
        when(strokes, "with this --protocol, which asks for nothing")
    }),
    rule(&["eval"], &["query"], |g| when(!g.is("protocol", "spin-nerf"), "without --protocol spin-nerf")),
    rule(&["eval"], &["pictures"], |g| {
        let strokes = g.is("protocol", "strokes") || g.is("protocol", "corrections");
        when(g.has("masks") && strokes, "with this --protocol, which draws no images")
    }),
    rule(&["eval"], &["keep_borders"], |g| when(g.has("masks"), "with --masks, which compares no colors")),
    rule(&["eval"], &["align_poses", "fit_exposure"], |g| {
        when(g.has_any(&["masks", "questions", "depth", "removal"]), "where no colors are compared with photos")
    }),
    rule(&["eval"], &["keep_borders", "pictures"], |g| {
        when(g.has("questions"), "with --questions, which draws no images")
    }),
    rule(&["eval"], &["keep_borders", "pictures"], |g| when(g.has("depth"), "with --depth, which compares no colors")),
    // Training.
    rule(&["train"], &["bind_anywhere", "host", "token_file"], |g| when(!g.has("serve"), "without --serve")),
    rule(&["demo"], TRAINING, |g| when(g.has("make"), "with --make, which has settings of its own")),
    rule(&["demo"], &["json"], |g| when(g.has("make"), "with --make")),
    rule(&["demo"], TRAINING, |g| when(!g.has("headless"), "without --headless: the window has its own settings")),
    rule(&["demo"], &["out", "json"], |g| when(!g.has_any(&["headless", "make"]), "without --headless")),
    rule(&["demo"], &["held_out_every"], |_| Some("here: the demo's photos say which of them are held out")),
    rule(&["train", "demo"], &["max_gaussians"], |g| when(g.has("no_densify"), "with --no-densify, which adds none")),
    rule(&["train", "demo"], &["sh_at_once"], |g| {
        when(g.is("sh_degree", "0"), "with --sh-degree 0, which has one band only")
    }),
    rule(&["train", "demo"], &["antialias", "no_antialias"], |g| {
        when(g.has("surfels"), "with --surfels, which are never filtered")
    }),
    rule(&["train", "demo"], &["distortion_weight"], |g| when(!g.has("surfels"), "without --surfels")),
    // Objects and parts.
    rule(&["preprocess"], &["tracker_model", "prompt"], |g| {
        when(!tracks(g), "without --tracker sam2 or both, which follow masks by it")
    }),
    rule(&["preprocess"], &["tracker_model"], |g| when(g.has("add"), "with --add, which looks at one photo")),
    rule(&["preprocess"], &["mask_grid"], |g| when(without_network(g), "where no network is asked for masks")),
    rule(&["preprocess"], &["code_steps"], |g| when(lifts_by_votes(g), "with --lifting votes, which trains no codes")),
    rule(&["preprocess"], &["part_weight"], |g| when(g.is("encoder", "none"), "with --encoder none")),
    rule(&["remove"], &["paint", "seed"], |g| when(g.is("fill", "none"), "with --fill none")),
    rule(&["remove"], &["seed"], |g| when(!g.is("paint", "patches"), "here: only --paint patches chooses at random")),
    // Poses of photos.
    rule(&["locate"], &["check_others", "unknown_focal", "check_changes"], |g| {
        when(!g.has("check"), "without --check")
    }),
    rule(&["poses"], &["out", "maker", "frames", "install", "compare", "json"], |g| {
        when(g.has("by_hand"), "with --by-hand, which finds nothing")
    }),
    rule(&["poses"], &["install"], |g| {
        when(
            g.is("maker", "colmap") || g.is("maker", "built-in"),
            "with this --maker: it is pycolmap that is installed",
        )
    }),
    rule(&["locate"], &["focal_px", "out"], |g| when(g.has("check"), "with --check, which locates held-out photos")),
    // Pictures and flights.
    rule(&["render"], &["quality", "fps", "mark", "ffmpeg"], |g| when(!g.has("path"), "without --path")),
    rule(&["render"], &["quality"], |g| when(frames(g) && !g.has("ffmpeg"), "on frames, which lose nothing")),
    rule(&["path"], &["side", "distance"], |g| when(!g.has("to"), "without --to")),
    rule(&["path"], &["from", "aspect"], |g| when(g.has("survey"), "with --survey")),
    rule(&["path"], &["aspect"], |g| when(g.has("to_photo") && !g.has("out"), "without --out")),
    rule(&["path"], &["cameras"], |g| when(!g.has("survey"), "without --survey")),
    rule(&["export"], &["title", "path"], |g| when(!g.has("html"), "without --html")),
    rule(&["export"], &["no_measure"], |g| when(!g.has("out"), "without --out")),
    // Talks and reports.
    rule(&["agent"], &["url", "model", "key_variable"], |g| {
        when(!g.is("planner", "llm") && !g.has("test_model"), "without --planner llm")
    }),
    rule(&["agent"], &["from", "planner", "policy", "meters", "view", "transcript"], |g| {
        when(g.has_any(&["find_model", "test_model"]), "without a scene")
    }),
    rule(&["agent"], RECIPE, |g| when(g.has_any(&["find_model", "test_model"]), "without a scene")),
    rule(&["agent"], &["url", "model", "key_variable"], |g| when(g.has("find_model"), "with --find-model")),
    rule(&["agent"], &["json"], |g| when(g.has("test_model"), "with --test-model")),
    rule(&["report"], &["from"], |g| when(!g.has("defaults"), "without --defaults")),
    rule(
        &["report"],
        &["stages", "budget", "repeats", "masks", "steps", "train_steps", "max_side", "view_count", "out", "fresh"],
        |g| when(g.has("defaults"), "with --defaults, which measures nothing"),
    ),
    rule(&["report"], RECIPE, |g| when(g.has("defaults"), "with --defaults, which measures nothing")),
    rule(&["report"], &["masks"], |g| {
        when(without_stages(g, &["features", "query"]), "without the stages 'features' and 'query'")
    }),
    rule(&["report"], &["steps"], |g| when(without_stages(g, &["features"]), "without the stage 'features'")),
    rule(&["report"], &["train_steps"], |g| when(without_stages(g, &["train"]), "without the stage 'train'")),
    rule(&["report"], RECIPE, |g| when(without_stages(g, &["query"]), "without the stage 'query'")),
    rule(&["report"], &["steps"], |g| when(!g.has("masks"), "without --masks, which the stage 'features' needs")),
    rule(&["report"], RECIPE, |g| when(!g.has("masks"), "without --masks, which the stage 'query' needs")),
    rule(&["report"], &["view_count"], |g| {
        when(without_stages(g, &["render", "train", "features", "query", "depth"]), "with these stages")
    }),
    rule(&["batch"], &["retry_failed", "takeover_secs"], |g| {
        when(g.has("dry_run"), "with --dry-run, which runs nothing")
    }),
    rule(&["bench"], &["identities"], |g| when(!g.has("queries"), "without --queries")),
    rule(&["bench"], &["mask_grid", "photo"], |g| when(!g.has("masks"), "without --masks")),
    rule(&["bench"], &["size", "max_side", "gpu"], |g| when(!g.has("paths"), "without scenes, splats or photos")),
    rule(&["models fetch", "models add"], &["json"], |_| Some("here: what comes of it is one line")),
    rule(&["synth"], &["keep_shadow"], |g| when(!g.has("without"), "without --without")),
    rule(&["edit"], &["axis"], |g| when(!g.has("turn"), "without --turn")),
    rule(&["connect"], &["save", "json"], |g| when(!g.has("headless"), "without --headless")),
];

//! Changes that applying a measured setting would make, or the reason why it cannot be applied.

use serde::Serialize;
use serde_json::{Map, Value};

use super::super::super::layout::Layout;
use super::super::super::viewport::overrides::RenderOverrides;
use crate::math::format::share;
use crate::measure::{Knobs, Point, Stage, StageName, turned};
use crate::pipeline::train::TrainConfig;
use crate::render::{Cutoffs, RenderSettings};
use crate::ui::actions::Action;

/// The active settings.
pub(crate) struct Now<'a> {
    /// Settings of the next training.
    pub(crate) config: &'a TrainConfig,
    /// Render settings of the open scene; `None` without a scene.
    pub(crate) own: Option<&'a RenderSettings>,
    /// The user's overrides of the render settings.
    pub(crate) drawing: &'a RenderOverrides,
    /// True if a GPU draws.
    pub(crate) on_gpu: bool,
}

/// A field that would change.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Change {
    pub(crate) name: String,
    pub(crate) from: String,
    pub(crate) to: String,
}

/// Result of a request to apply a measured setting.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Offer {
    Changes(Vec<Change>, Action),
    /// The setting is active already.
    Active,
    /// The setting cannot be applied, with the reason.
    Not(String),
}

/// The changes that applying a point of a stage would make.
pub(crate) fn offer(stage: &Stage, point: &Point, now: &Now<'_>) -> Offer {
    let result = match stage.name {
        StageName::Train => training(stage, point, now),
        StageName::Render => drawing(stage, point, now),
        StageName::Features => Err("Objects are found with the default; this stage compares alternatives.".into()),
        _ => Err("The window has no such setting.".into()),
    };
    match result {
        Ok((changes, _)) if changes.is_empty() => Offer::Active,
        Ok((changes, action)) => Offer::Changes(changes, action),
        Err(why) => Offer::Not(why),
    }
}

type Taken = Result<(Vec<Change>, Action), String>;

fn training(stage: &Stage, point: &Point, now: &Now<'_>) -> Taken {
    // Defaults are those of this window, for every knob of the sweep.
    let standard = fields(&Layout::default().config);
    let knobs = resolved(stage, point, |name| standard.get(name).cloned().unwrap_or_default());
    let config = turned(now.config, &knobs).map_err(|e| format!("The report does not fit this version: {e}."))?;
    if config.sh_degree > 3 || config.steps == 0 || !(0.0..=1.0).contains(&config.coarse_share) {
        return Err("These settings are out of range.".into());
    }
    Ok((changes(now.config, &config, &knobs), Action::ApplySetting(stage.name, knobs)))
}

fn drawing(stage: &Stage, point: &Point, now: &Now<'_>) -> Taken {
    let own = now.own.ok_or("Open a scene first: there is nothing to render yet.")?;
    let names = fields(&RenderOverrides::default());
    if let Some(name) = point.knobs.keys().find(|name| !names.contains_key(*name)) {
        return Err(no_setting(name).into());
    }
    let mut knobs = resolved(stage, point, |_| Value::Null);
    knobs.retain(|name, _| names.contains_key(name));
    let then = turned(now.drawing, &knobs).map_err(|e| format!("The report does not fit this version: {e}."))?;
    if let Some(problem) = then.problem() {
        return Err(format!("Nothing can be rendered with it: {problem}."));
    }
    if now.on_gpu && then.cutoffs.is_some_and(|c| c != Cutoffs::default()) {
        return Err("The GPU renders with the default cutoffs; others are for the CPU.".into());
    }
    let [before, after] = [now.drawing, &then].map(|d| d.over(own.clone(), now.on_gpu));
    Ok((changes(&before, &after, &knobs), Action::ApplySetting(stage.name, knobs)))
}

/// Reason why a knob of rendering is no setting of the view.
fn no_setting(name: &str) -> &'static str {
    match name {
        "precision" => "The view is rendered in single precision; the others are measured for comparison.",
        "backend" => "The backend is chosen when the window opens: a real GPU if there is one, else the CPU.",
        "scale" => "The view adapts its resolution: lower while the camera moves, full at rest.",
        "keep_order" | "degrees" => "A reused depth order is wrong as soon as the camera moves.",
        _ => "The view has no such setting.",
    }
}

/// Knobs of a point; for the default point, all knobs of the stage with the values of `standard`.
fn resolved(stage: &Stage, point: &Point, standard: impl Fn(&str) -> Value) -> Knobs {
    if !point.default {
        return point.knobs.clone();
    }
    let names = stage.points.iter().flat_map(|p| p.knobs.keys());
    names.map(|name| (name.clone(), standard(name))).collect()
}

/// The fields among `knobs` in which two settings differ.
fn changes<T: Serialize>(before: &T, after: &T, knobs: &Knobs) -> Vec<Change> {
    let (before, after) = (fields(before), fields(after));
    let differs = |name: &&String| before.get(*name) != after.get(*name);
    let text = |value: Option<&Value>| value.map_or_else(String::new, words);
    let change = |name: &String| Change {
        name: name.replace('_', " "),
        from: text(before.get(name)),
        to: text(after.get(name)),
    };
    knobs.keys().filter(differs).map(change).collect()
}

/// A value as text for the user.
fn words(value: &Value) -> String {
    match value {
        Value::Null => "automatic".into(),
        Value::Bool(on) => if *on { "on" } else { "off" }.into(),
        Value::String(text) => text.clone(),
        Value::Object(fields) => {
            let field = |(name, v): (&String, &Value)| match v.as_f64() {
                Some(v) => format!("{name} {}", share(v)),
                None => format!("{name} {v}"),
            };
            fields.iter().map(field).collect::<Vec<_>>().join(", ")
        }
        other => other.to_string(),
    }
}

fn fields<T: Serialize>(settings: &T) -> Map<String, Value> {
    match serde_json::to_value(settings) {
        Ok(Value::Object(fields)) => fields,
        _ => Map::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn point(name: &str, value: Value) -> Point {
        Point { method: name.into(), knobs: Knobs::from([(name.to_owned(), value)]), ..Point::default() }
    }

    fn stage(name: StageName, points: Vec<Point>) -> Stage {
        Stage {
            name,
            secs_of: String::new(),
            reference: String::new(),
            input: Knobs::new().into_iter().map(|(k, v)| (k, v.to_string())).collect(),
            seeds: vec![0],
            planned: points.len(),
            measures: Vec::new(),
            rule: crate::measure::Rule { measure: String::new(), times: 1.0, floor: 0.0, spare_secs: 0.0 },
            points,
            orders: Vec::new(),
            left_out: Vec::new(),
        }
    }

    fn now<'a>(config: &'a TrainConfig, own: Option<&'a RenderSettings>, drawing: &'a RenderOverrides) -> Now<'a> {
        Now { config, own, drawing, on_gpu: false }
    }

    #[test]
    fn settings_of_trainings_are_taken_over_and_defaults_taken_back() {
        let (config, drawing) = (TrainConfig { steps: 500, ..Layout::default().config }, RenderOverrides::default());
        let half = point("coarse_share", json!(0.3));
        let default = Point { default: true, ..Point::default() };
        let s = stage(StageName::Train, vec![default.clone(), half.clone(), point("steps", json!(500))]);
        let now = now(&config, None, &drawing);
        let Offer::Changes(changes, Action::ApplySetting(StageName::Train, knobs)) = offer(&s, &half, &now) else {
            panic!("it can be applied");
        };
        let change = Change { name: "coarse share".into(), from: "0.0".into(), to: "0.3".into() };
        assert_eq!(changes, [change]);
        assert_eq!(turned(&config, &knobs).expect("fits"), TrainConfig { coarse_share: 0.3, ..config.clone() });
        assert_eq!(offer(&s, &s.points[2], &now), Offer::Active);
        let Offer::Changes(changes, Action::ApplySetting(_, knobs)) = offer(&s, &default, &now) else {
            panic!("steps differ");
        };
        assert_eq!((changes.len(), changes[0].to.as_str()), (1, "3000"));
        assert_eq!(turned(&config, &knobs).expect("fits"), Layout::default().config);
        for bad in [point("nonesuch", json!(1)), point("steps", json!("many")), point("coarse_share", json!(7.0))] {
            assert!(matches!(offer(&s, &bad, &now), Offer::Not(_)), "{bad:?}");
        }
    }

    #[test]
    fn settings_of_drawing_are_taken_over_where_the_view_has_them() {
        let (config, own, drawing) = (TrainConfig::default(), RenderSettings::default(), RenderOverrides::default());
        let cut = point("cutoffs", json!({"alpha": 1.0 / 64.0, "transmittance": 1e-4}));
        let default = Point { default: true, ..Point::default() };
        let s = stage(StageName::Render, vec![default.clone(), cut.clone(), point("precision", json!("half"))]);
        let here = now(&config, Some(&own), &drawing);
        let Offer::Changes(changes, Action::ApplySetting(_, knobs)) = offer(&s, &cut, &here) else {
            panic!("it can be applied");
        };
        assert_eq!(changes[0].from, "alpha 1/255, transmittance 1e-4");
        assert_eq!(changes[0].to, "alpha 1/64, transmittance 1e-4");
        assert_eq!(offer(&s, &default, &here), Offer::Active);
        let chosen = turned(&drawing, &knobs).expect("fits");
        let Offer::Changes(_, Action::ApplySetting(_, back)) = offer(&s, &default, &now(&config, Some(&own), &chosen))
        else {
            panic!("back to the scene's own");
        };
        assert_eq!(turned(&chosen, &back).expect("fits"), RenderOverrides::default());
        let not = |point: &Point, now: &Now<'_>| match offer(&s, point, now) {
            Offer::Not(why) => why,
            other => panic!("{other:?}"),
        };
        assert!(not(&cut, &Now { on_gpu: true, ..now(&config, Some(&own), &drawing) }).contains("GPU"));
        assert!(not(&cut, &now(&config, None, &drawing)).contains("Open a scene"));
        assert!(not(&s.points[2], &here).contains("single precision"));
        assert!(not(&point("cutoffs", json!({"alpha": 0.0, "transmittance": 1.0})), &here).contains("cutoffs"));
        let other = stage(StageName::Path, vec![]);
        assert!(matches!(offer(&other, &cut, &here), Offer::Not(_)));
    }
}

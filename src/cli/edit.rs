//! `fmlgs edit`: objects and parts are moved, duplicated and recolored.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DQuat, DVec3};

use super::progress::Console;
use super::scene_args::open_scene;
use super::{CliError, output};
use crate::jobs::rearrange::{self, Arrangement, Grade, Placement, SplatEdit};
use crate::jobs::{derived, query};
use crate::math::{format, srgb};
use crate::scene::LevelFilter;

/// Move, turn, scale, duplicate or recolor an object or a part
///
/// It turns and scales about its own middle. The scene is left as it is; the result is a scene of its own, or a file of
/// splats.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs edit scene/ \"the mug\" --move 0.5,0,0 --turn 90 --out moved/\n  \
    fmlgs edit scene/ \"the mug\" --duplicate --move 0,0,1 --scale 0.5 --out two_mugs/\n  \
    fmlgs edit scene/ \"handle of the mug\" --color #c02020 --out red_handle.ply\n  \
    fmlgs edit scene/ \"the mug\" --brightness 1.3 --saturation 0.8 --out brighter/")]
#[command(group = clap::ArgGroup::new("what").required(true).multiple(true))]
pub(crate) struct EditArgs {
    /// Trained scene with objects and parts ('fmlgs preprocess')
    scene: PathBuf,
    /// Text of the object or part to edit
    text: String,
    /// Folder for the new scene, or a file of splats (.ply, .sog, .spz, ...)
    #[arg(long)]
    out: PathBuf,
    /// Shift it, scene units
    #[arg(long = "move", value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true, group = "what")]
    shift: Option<DVec3>,
    /// Turn it about the axis, counterclockwise where that points at you
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true, group = "what")]
    turn: Option<f64>,
    /// Axis that it turns about [default: up]
    #[arg(long, value_name = "X,Y,Z", value_parser = direction, allow_hyphen_values = true, requires = "turn")]
    axis: Option<DVec3>,
    /// Make it this many times as large
    #[arg(long, group = "what")]
    scale: Option<f64>,
    /// Leave it where it is and put another one there
    #[arg(long, group = "what")]
    duplicate: bool,
    /// Give it another color; its shades stay
    #[arg(long, value_name = "#RRGGBB", value_parser = color, group = "what")]
    color: Option<[f32; 3]>,
    /// Make its colors this many times as bright
    #[arg(long, value_name = "FACTOR", group = "what")]
    brightness: Option<f64>,
    /// Make its colors this many times as strong; 0 is gray
    #[arg(long, value_name = "FACTOR", group = "what")]
    saturation: Option<f64>,
    /// Tint it: white becomes this color, at its brightness
    #[arg(long, value_name = "#RRGGBB", value_parser = color, group = "what")]
    tint: Option<[f32; 3]>,
    /// Level of the answer: an object or a part
    #[arg(long, value_enum, default_value_t = LevelFilter::Auto)]
    kind: LevelFilter,
}

/// Three numbers.
pub(super) fn vector(text: &str) -> Result<DVec3, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|v| v.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, z]) if [x, y, z].iter().all(|v| v.is_finite()) => Ok(DVec3::new(x, y, z)),
        _ => Err("three numbers are needed: X,Y,Z".into()),
    }
}

fn direction(text: &str) -> Result<DVec3, String> {
    vector(text)?.try_normalize().ok_or_else(|| "it has no length".into())
}

/// Red, green and blue, 0 to 1.
fn color(text: &str) -> Result<[f32; 3], String> {
    let color = srgb::from_hex(text.strip_prefix('#').unwrap_or(text));
    Ok(color.ok_or("six hexadecimal digits are needed: #RRGGBB")?.map(|v| f32::from(v) / 255.0))
}

pub(crate) fn run(args: EditArgs, quiet: bool) -> Result<(), CliError> {
    let scene = open_scene(&args.scene)?;
    let map = scene.semantics()?;
    derived::check_place(&scene, &args.out)?;
    let id = query::one_named(&map, &query::seen_from(&scene, None), &args.text, args.kind)?;
    let axis = args.axis.unwrap_or_else(|| scene.home().up);
    let to = Placement {
        shift: args.shift.unwrap_or_default(),
        turn: DQuat::from_axis_angle(axis, args.turn.unwrap_or_default().to_radians()),
        scale: args.scale.unwrap_or(1.0),
    };
    let none = Grade::default();
    let grade = Grade {
        brightness: args.brightness.unwrap_or(none.brightness),
        saturation: args.saturation.unwrap_or(none.saturation),
        tint: args.tint.unwrap_or(none.tint),
    };
    let edit = SplatEdit::Arrange(Arrangement { id, duplicate: args.duplicate, to, color: args.color, grade });
    let (cloud, new) = rearrange::apply(&scene.cloud, Some(&map), &edit)?;
    let cloud = Arc::new(cloud);
    derived::write(&scene, derived::EDITED, &cloud, new.as_ref(), &args.out, &mut Console::new(quiet))?;
    let what = if args.duplicate { "duplicated" } else { "edited" };
    let (out, name, size) = (args.out.display(), map.identities.full_name(id), format::things(cloud.len(), "Gaussian"));
    output::print(&format!("{out}: {name} {what}, {size}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_and_colors_are_read() {
        assert_eq!(vector("-1, 0.5,2e1"), Ok(DVec3::new(-1.0, 0.5, 20.0)));
        assert!(["", "1,2", "1,2,3,4", "a,b,c", "nan,0,0", "inf,0,0"].iter().all(|bad| vector(bad).is_err()));
        assert!((direction("0,3,4").expect("one").length() - 1.0).abs() < 1e-12 && direction("0,0,0").is_err());
        assert_eq!(color("#ff0080"), Ok([1.0, 0.0, 128.0 / 255.0]));
        assert_eq!(color("00ff00"), Ok([0.0, 1.0, 0.0]));
        assert!(["", "#fff", "#gg0000", "#1234567", "red"].iter().all(|bad| color(bad).is_err()));
    }
}

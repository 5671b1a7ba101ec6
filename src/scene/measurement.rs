//! Measurements that a user has made in a scene: named points, and the numbers that follow from them.

use std::collections::BTreeMap;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::upright_box::UprightBox;
use crate::math::format;
use crate::math::geometry::{self, GeometryFault, PolygonFit};

/// Kind of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MeasurementKind {
    /// Length of a line through points.
    Length,
    /// Angle at the second of three points.
    Angle,
    /// Area of a polygon.
    Area,
    /// Upright box around an object; its points are a corner and the ends of its three edges.
    Box,
}

/// A named measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measurement {
    /// Number that no other measurement of the scene has.
    pub(crate) id: u32,
    /// Name, without control characters.
    pub name: String,
    pub(crate) kind: MeasurementKind,
    /// Points in the world, scene units.
    pub(crate) points: Vec<DVec3>,
    /// True if the view does not show it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(crate) hidden: bool,
}

/// Value of a measurement, in scene units and radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MeasuredValue {
    /// A length.
    Length(f64),
    /// An angle.
    Angle(f64),
    /// An area.
    Area(PolygonFit),
    /// Edges of a box: two level ones, the longer first, and its height.
    Box([f64; 3]),
}

impl MeasurementKind {
    /// All kinds in the order of the card.
    pub(crate) const ALL: [Self; 4] = [Self::Length, Self::Angle, Self::Area, Self::Box];
    /// Most points of one measurement.
    pub(crate) const MOST_POINTS: usize = 500;

    pub(crate) fn text(self) -> &'static str {
        match self {
            Self::Length => "Length",
            Self::Angle => "Angle",
            Self::Area => "Area",
            Self::Box => "Box",
        }
    }

    /// Number of points that it needs, and has at most.
    pub(crate) fn points(self) -> (usize, usize) {
        match self {
            Self::Length => (2, Self::MOST_POINTS),
            Self::Angle => (3, 3),
            Self::Area => (3, Self::MOST_POINTS),
            Self::Box => (4, 4),
        }
    }

    /// Value of these points.
    pub(crate) fn value(self, points: &[DVec3]) -> Result<MeasuredValue, GeometryFault> {
        match (self, points) {
            (Self::Length, points) => geometry::length(points).map(MeasuredValue::Length),
            (Self::Angle, [a, vertex, b, ..]) => geometry::angle([*a, *vertex, *b]).map(MeasuredValue::Angle),
            (Self::Area, points) => geometry::polygon(points).map(MeasuredValue::Area),
            (Self::Box, [corner, a, b, c, ..]) => {
                let size = UprightBox::of_ends([*corner, *a, *b, *c]).size();
                let is_finite = size.iter().all(|edge| edge.is_finite());
                if is_finite { Ok(MeasuredValue::Box(size)) } else { Err(GeometryFault::NotFinite) }
            }
            _ => Err(GeometryFault::TooFew),
        }
    }
}

impl Measurement {
    /// Its value.
    pub fn value(&self) -> Result<MeasuredValue, GeometryFault> {
        self.kind.value(&self.points)
    }

    /// Its value as text, or why it has none.
    pub fn text(&self, meters_per_unit: Option<f64>) -> String {
        self.value().map_or_else(|fault| fault.to_string(), |value| value.text(meters_per_unit))
    }
}

impl MeasuredValue {
    /// The value in meters if the length of a unit is known, else in scene units.
    pub(crate) fn text(&self, meters_per_unit: Option<f64>) -> String {
        match self {
            Self::Length(length) => format::length(*length, meters_per_unit),
            Self::Angle(angle) => format!("{:.1}\u{b0}", angle.to_degrees()),
            Self::Area(fit) => format::area(fit.area, meters_per_unit),
            Self::Box(edges) if meters_per_unit.is_none() => {
                format!("{} units", edges.map(format::short).join(" \u{d7} "))
            }
            Self::Box(edges) => {
                let edges = edges.map(|edge| format::length(edge, meters_per_unit));
                edges.join(" \u{d7} ")
            }
        }
    }

    /// What else is known: the distance of corners from their plane, the volume of a box.
    pub(crate) fn remark(&self, meters_per_unit: Option<f64>) -> Option<String> {
        match self {
            Self::Length(_) | Self::Angle(_) => None,
            // Three corners are always in a plane.
            Self::Area(fit) if fit.farthest <= 1e-9 * fit.area.sqrt() => None,
            Self::Area(fit) => {
                let [rms, most] = [fit.rms, fit.farthest].map(|d| format::length(d, meters_per_unit));
                Some(format!("corners within {most} of a plane (RMS {rms})"))
            }
            Self::Box([a, b, c]) => Some(format!("volume of the box {}", format::volume(a * b * c, meters_per_unit))),
        }
    }
}

/// First free name of a kind: "Length 2".
pub(crate) fn free_name(base: &str, all: &[Measurement]) -> String {
    let names = (1..).map(|n: u32| format!("{base} {n}"));
    names.into_iter().find(|name| all.iter().all(|m| m.name != *name)).unwrap_or_default()
}

/// Measurements to store: what was changed from `base` to `ours`, put into `theirs`, which someone else may have stored
/// since. A measurement that both changed is ours.
pub(crate) fn merged(base: &[Measurement], ours: &[Measurement], theirs: &[Measurement]) -> Vec<Measurement> {
    let of = |all: &[Measurement]| all.iter().map(|m| (m.id, m.clone())).collect::<BTreeMap<_, _>>();
    let (base, own, other) = (of(base), of(ours), of(theirs));
    let keeps = |m: &Measurement| match own.get(&m.id) {
        // Deleted here, or unknown here.
        None => (!base.contains_key(&m.id)).then(|| m.clone()),
        Some(own) if base.get(&m.id) == Some(own) => Some(m.clone()),
        Some(own) => Some(own.clone()),
    };
    let stays = theirs.iter().filter_map(keeps);
    // Deleted there, unless it was changed here.
    let new = ours.iter().filter(|m| !other.contains_key(&m.id) && base.get(&m.id) != Some(m)).cloned();
    stays.chain(new).collect()
}

/// Description of a change, for the history.
pub(crate) fn change_text(before: &[Measurement], now: &[Measurement]) -> String {
    let without = |all: &[Measurement], m: &Measurement| all.iter().all(|other| other.id != m.id);
    if let Some(added) = now.iter().find(|m| without(before, m)) {
        return format!("measured {}", added.name);
    }
    if let Some(gone) = before.iter().find(|m| without(now, m)) {
        return format!("deleted the measurement {}", gone.name);
    }
    let changed = before.iter().zip(now).find(|(a, b)| a != b);
    match changed {
        Some((a, b)) if a.name != b.name => format!("renamed the measurement {} to {}", a.name, b.name),
        Some((a, b)) => format!("{} the measurement {}", if b.hidden { "hid" } else { "showed" }, a.name),
        None => "changed the measurements".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(id: u32, name: &str) -> Measurement {
        let points = vec![DVec3::ZERO, DVec3::X * 2.0];
        Measurement { id, name: name.into(), kind: MeasurementKind::Length, points, hidden: false }
    }

    #[test]
    fn values_are_in_meters_once_the_scale_is_known() {
        let square = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y].to_vec();
        let of = |kind, points: &[DVec3]| Measurement { kind, points: points.to_vec(), ..line(1, "") };
        assert_eq!((line(1, "a").text(None), line(1, "a").text(Some(0.1))), ("2 units".into(), "20 cm".into()));
        let mut square = square;
        square[2].z = 0.01;
        let area = of(MeasurementKind::Area, &square);
        assert_eq!((area.text(None), area.text(Some(2.0))), ("1.000 units\u{b2}".into(), "4.000 m\u{b2}".into()));
        let remark = area.value().expect("an area").remark(Some(2.0));
        assert_eq!(remark.as_deref(), Some("corners within 5 mm of a plane (RMS 5 mm)"));
        let flat = of(MeasurementKind::Area, &square[..3]).value().expect("an area");
        assert_eq!(flat.remark(None), None, "three corners are always in a plane");
        assert_eq!(of(MeasurementKind::Angle, &square[..3]).text(None), "90.0\u{b0}");
        let cube = of(MeasurementKind::Box, &[DVec3::ZERO, DVec3::X * 3.0, DVec3::Y * 2.0, DVec3::Z]);
        assert_eq!(cube.text(None), "3 \u{d7} 2 \u{d7} 1 units");
        assert_eq!(cube.text(Some(1.0)), "3 m \u{d7} 2 m \u{d7} 1 m");
        let volume = cube.value().expect("a box").remark(Some(1.0));
        assert_eq!(volume.as_deref(), Some("volume of the box 6.000 m\u{b3}"));
        // Controls: too few points, and none that are numbers.
        assert_eq!(of(MeasurementKind::Angle, &square[..2]).text(None), "more points are needed");
        assert_eq!(of(MeasurementKind::Box, &[DVec3::NAN; 4]).value(), Err(GeometryFault::NotFinite));
    }

    #[test]
    fn two_windows_keep_each_others_measurements() {
        let base = [line(1, "a"), line(2, "b"), line(3, "c")];
        let ours = [line(1, "A"), line(3, "c"), line(4, "ours")];
        let theirs = [line(1, "a"), line(2, "b"), line(5, "theirs")];
        let names = |all: &[Measurement]| all.iter().map(|m| m.name.clone()).collect::<Vec<_>>();
        let both = merged(&base, &ours, &theirs);
        assert_eq!(names(&both), ["A", "theirs", "ours"], "renamed and deleted here, deleted and added there");
        assert_eq!(merged(&base, &base, &theirs), theirs, "without a change here, theirs stay");
        assert_eq!(names(&merged(&base, &[line(3, "C")], &theirs)), ["theirs", "C"], "a change wins over a deletion");
        // Control: without what was known before, nothing is a deletion.
        assert_eq!(names(&merged(&[], &ours, &theirs)), ["A", "b", "theirs", "c", "ours"]);
    }

    #[test]
    fn changes_are_described() {
        let all = [line(1, "a"), line(2, "b")];
        assert_eq!(change_text(&all[..1], &all), "measured b");
        assert_eq!(change_text(&all, &all[1..]), "deleted the measurement a");
        assert_eq!(change_text(&all, &[line(1, "c"), line(2, "b")]), "renamed the measurement a to c");
        let hidden = Measurement { hidden: true, ..line(1, "a") };
        assert_eq!(change_text(&all[..1], std::slice::from_ref(&hidden)), "hid the measurement a");
        assert_eq!(change_text(std::slice::from_ref(&hidden), &all[..1]), "showed the measurement a");
        assert_eq!(
            (free_name("a", &[]), free_name("Length", &[line(1, "Length 1")])),
            ("a 1".into(), "Length 2".into())
        );
    }
}

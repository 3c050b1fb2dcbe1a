//! What each property of a table of points means.

use super::header::{Element, Kind};
use super::scalar::Scalar;
use crate::{Error, Place, Usage};
use std::ops::Range;
use std::path::Path;

/// Number of values of a row that can be of use.
pub(super) const SLOTS: usize = 24;

pub(super) const POSITION: Range<usize> = 0..3;
pub(super) const NORMAL: Range<usize> = 3..6;
pub(super) const COLOR: Range<usize> = 6..9;
pub(super) const OPACITY: usize = 9;
pub(super) const SIZE: usize = 10;
pub(super) const AREA: usize = 11;
pub(super) const TANGENTS: Range<usize> = 12..18;
pub(super) const TEXTURE: Range<usize> = 18..20;
pub(super) const TEXTURE_DERIVATIVES: Range<usize> = 20..24;

/// The names of each slot; the first name that is present counts.
const NAMES: [&[&str]; SLOTS] = [
    &["x"],
    &["y"],
    &["z"],
    &["nx", "normal_x", "normalx"],
    &["ny", "normal_y", "normaly"],
    &["nz", "normal_z", "normalz"],
    &["red", "r", "diffuse_red"],
    &["green", "g", "diffuse_green"],
    &["blue", "b", "diffuse_blue"],
    &["opacity", "alpha", "a", "diffuse_alpha"],
    &["radius", "psz", "size", "pscale", "scale"],
    &["area"],
    &["tu_x"],
    &["tu_y"],
    &["tu_z"],
    &["tv_x"],
    &["tv_y"],
    &["tv_z"],
    &["s", "u", "texture_u", "texture_s", "texcoord_u"],
    &["t", "v", "texture_v", "texture_t", "texcoord_v"],
    &["ds_du"],
    &["dt_du"],
    &["ds_dv"],
    &["dt_dv"],
];

/// Slots that are of use only together.
const GROUPS: [(Range<usize>, Usage); 9] = [
    (POSITION, Usage::Position),
    (NORMAL, Usage::Normal),
    (COLOR, Usage::Color),
    (OPACITY..OPACITY + 1, Usage::Opacity),
    (SIZE..SIZE + 1, Usage::Size),
    (AREA..AREA + 1, Usage::Area),
    (TANGENTS, Usage::Tangent),
    (TEXTURE, Usage::TextureCoordinate),
    (TEXTURE_DERIVATIVES, Usage::TextureDerivative),
];

/// The meaning of each property.
pub(super) struct Roles {
    /// Per property, where its values go.
    pub slots: Vec<Option<usize>>,
    /// Per slot, the type of its property, where there is one.
    pub kinds: [Option<Scalar>; SLOTS],
    /// Per property, what is said of it.
    pub usages: Vec<Usage>,
    /// The name of the property that gives the size.
    pub size_name: Option<String>,
}

impl Roles {
    /// Decides what each property of the table of points is used for.
    ///
    /// Refuses a table without the three coordinates.
    pub fn assign(element: &Element, path: &Path) -> Result<Self, Error> {
        let properties = &element.properties;
        let scalar = |index: usize| match properties[index].kind {
            Kind::Scalar(kind) => Some(kind),
            Kind::List { .. } => None,
        };
        let mut usages: Vec<_> = properties
            .iter()
            .map(|property| Usage::Unused(why_unused(&property.name, property.kind)))
            .collect();
        let mut slots = vec![None; properties.len()];
        let mut kinds = [None; SLOTS];
        let mut size_name = None;
        let chosen: [Option<usize>; SLOTS] = std::array::from_fn(|slot| {
            NAMES[slot].iter().find_map(|name| {
                let known = |index: &usize| properties[*index].name.eq_ignore_ascii_case(name);
                (0..properties.len()).find(|index| known(index) && scalar(*index).is_some())
            })
        });
        let is_whole = |group: Range<usize>| chosen[group].iter().all(Option::is_some);
        let (is_elliptical, is_textured) = (is_whole(TANGENTS), is_whole(TEXTURE));
        for (group, usage) in GROUPS {
            let present = is_whole(group.clone());
            for slot in group {
                let Some(index) = chosen[slot] else { continue };
                if !present {
                    usages[index] = Usage::Unused("the other components are missing");
                } else if slot == SIZE && is_elliptical {
                    usages[index] = Usage::Unused("the tangent axes give the size");
                } else if TEXTURE_DERIVATIVES.contains(&slot) && !is_textured {
                    usages[index] = Usage::Unused("the texture coordinates are missing");
                } else {
                    usages[index] = usage;
                    slots[index] = Some(slot);
                    kinds[slot] = scalar(index);
                    if slot == SIZE {
                        size_name = Some(properties[index].name.clone());
                    }
                }
            }
        }
        if kinds[POSITION].contains(&None) {
            let names: Vec<_> = element.properties.iter().take(16).map(|p| p.name.as_str()).collect();
            let found = match names[..] {
                [] => "no property".to_owned(),
                _ => format!("the properties {}", names.join(", ")),
            };
            let expected = format!("the numbers x, y and z in element {}", element.name);
            return Err(Error::invalid(path, Place::Line(element.line), found, expected));
        }
        Ok(Self { slots, kinds, usages, size_name })
    }
}

/// Why a property that found no use has none.
fn why_unused(name: &str, kind: Kind) -> &'static str {
    let is = |known: &str| name.eq_ignore_ascii_case(known);
    if matches!(kind, Kind::List { .. }) {
        "a list"
    } else if ["confidence", "quality", "intensity"].into_iter().any(is) {
        "a measurement, not part of the picture"
    } else if NAMES.iter().copied().flatten().copied().any(is) {
        "another property of this meaning comes first"
    } else {
        "unknown"
    }
}

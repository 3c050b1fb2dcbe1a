//! What each property of a table of points means.

use super::{Element, Kind, Scalar};
use crate::{Error, Place, Usage};
use std::ops::Range;
use std::path::Path;

/// Greatest number of scalar fields of a cloud; further columns are left out.
pub(crate) const MOST_FIELDS: usize = 32;

/// Number of values of a row that have a meaning.
const KNOWN: usize = 24;

/// Number of values of a row that can be of use.
pub(crate) const SLOTS: usize = KNOWN + MOST_FIELDS;

/// The values of a row: a slot each, by meaning; behind them the scalar fields.
pub(crate) type Row = [f64; SLOTS];

pub(crate) const POSITION: Range<usize> = 0..3;
pub(crate) const NORMAL: Range<usize> = 3..6;
pub(crate) const COLOR: Range<usize> = 6..9;
pub(crate) const OPACITY: usize = 9;
pub(crate) const SIZE: usize = 10;
pub(crate) const AREA: usize = 11;
pub(crate) const TANGENTS: Range<usize> = 12..18;
pub(crate) const TEXTURE: Range<usize> = 18..20;
pub(crate) const TEXTURE_DERIVATIVES: Range<usize> = 20..24;
/// The first scalar field.
pub(crate) const FIELDS: usize = KNOWN;

/// The names of each slot; the first name that is present counts.
const NAMES: [&[&str]; KNOWN] = [
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
pub(crate) struct Roles {
    /// Per property, where its values go.
    pub slots: Vec<Option<usize>>,
    /// Per slot, the type of its property, where there is one.
    pub kinds: [Option<Scalar>; KNOWN],
    /// Per property, what is said of it.
    pub usages: Vec<Usage>,
    /// The name of the property that gives the size.
    pub size_name: Option<String>,
    /// The names of the scalar fields: what is a number and means nothing else.
    pub field_names: Vec<String>,
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
        let mut usages: Vec<_> =
            properties.iter().map(|property| why_unused(&property.name, property.kind)).collect();
        let mut slots = vec![None; properties.len()];
        let mut kinds = [None; KNOWN];
        let mut size_name = None;
        let chosen: [Option<usize>; KNOWN] = std::array::from_fn(|slot| {
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
        let mut field_names = Vec::new();
        for (index, property) in properties.iter().enumerate() {
            if usages[index] == UNKNOWN && field_names.len() < MOST_FIELDS {
                usages[index] = Usage::Field;
                slots[index] = Some(FIELDS + field_names.len());
                field_names.push(property.name.clone());
            }
        }
        Ok(Self { slots, kinds, usages, size_name, field_names })
    }
}

/// What is said of a number without a known meaning that found no place among the scalar fields.
const UNKNOWN: Usage = Usage::Unused("one field too many");

/// Why a property that found no use has none.
fn why_unused(name: &str, kind: Kind) -> Usage {
    if matches!(kind, Kind::List { .. }) {
        Usage::Unused("a list")
    } else if NAMES.iter().copied().flatten().any(|known| name.eq_ignore_ascii_case(known)) {
        Usage::Unused("another property of this meaning comes first")
    } else {
        UNKNOWN
    }
}

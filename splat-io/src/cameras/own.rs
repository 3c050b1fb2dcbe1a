//! Our own cameras, as JSON.
//!
//! One object with these fields, and no others, or `{"cameras": [..]}` with a list of them:
//!
//! | field | meaning |
//! |---|---|
//! | `name` | of the camera; may be absent |
//! | `model` | "pinhole" or "orthographic" |
//! | `width`, `height` | pixels of the full frame |
//! | `fx`, `fy` | pinhole: focal length, in pixels |
//! | `pixels_per_unit` | orthographic: pixels a camera unit |
//! | `cx`, `cy` | principal point, in pixels; the first pixel's centre is at 0.5; orthographic: absent is the middle |
//! | `k1`, `k2`, `k3`, `p1`, `p2` | pinhole: lens distortion ([`splat_core::Distortion`]); absent is 0 |
//! | `world_to_camera` | 4 rows of 4 numbers, for column vectors: p_camera = M p_world |
//! | `near`, `far` | range of depth, in camera units; absent or null: 1e-4 of the cloud's diagonal, and infinity |
//! | `fstop` | f-number of a thin lens whose image plane is at 1; absent or null: no lens |
//! | `lens_radius` | radius of a thin lens, in scene units; overrides `fstop` |
//! | `focus` | depth of the plane of focus, in camera units; null: infinity; needed with a lens |
//! | `blades` | 3 or more straight blades of the aperture; 0 or absent: round |
//!
//! Without `fstop` or `lens_radius` there is no lens, and `focus` and `blades` say nothing.

use super::{CameraSet, NamedCamera, check, from_json, name_or_number, read_text};
use crate::{AtomicFile, Error, Place};
use glam::{DMat4, DVec2};
use serde::{Deserialize, Deserializer, Serialize};
use splat_core::{Camera, Distortion, Lens, Projection};
use std::io::Write;
use std::path::Path;

/// Greatest size of the file of one camera, in MiB.
const MOST_MEBIBYTES: u64 = 1;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Model {
    Pinhole,
    Orthographic,
}

/// The object as it stands in the file.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraJson {
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<String>,
    model: Model,
    width: u32,
    height: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    fx: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    fy: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pixels_per_unit: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    cx: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    cy: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    k1: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    k2: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    k3: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    p1: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    p2: Option<f64>,
    world_to_camera: [[f64; 4]; 4],
    #[serde(skip_serializing_if = "Option::is_none")]
    near: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    far: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    fstop: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    lens_radius: Option<f64>,
    /// Absent: `None`; null: `Some(None)`.
    #[serde(default, deserialize_with = "present", skip_serializing_if = "Option::is_none")]
    focus: Option<Option<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    blades: Option<u32>,
}

/// Several objects.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ListJson {
    cameras: Vec<CameraJson>,
}

/// Tells a field that is null from one that is absent.
fn present<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Option<f64>>, D::Error> {
    Option::deserialize(deserializer).map(Some)
}

/// Reads a camera from a JSON file. See the [module](self) for the fields.
///
/// `default_near` is the near depth, in scene units, where the file has none: 1e-4 of the cloud's diagonal.
///
/// # Errors
/// [`Error::Io`]; [`Error::Limit`] beyond 1 MiB; [`Error::Invalid`] if it is no UTF-8; otherwise as
/// [`parse_camera_json`].
pub fn read_camera_json(path: &Path, default_near: f64) -> Result<Camera, Error> {
    parse_camera_json(&read_text(path, MOST_MEBIBYTES)?, path, default_near)
}

/// Reads a camera from JSON text; `path` is its name in messages, `default_near` as in [`read_camera_json`].
///
/// # Errors
/// [`Error::Json`] for what is no JSON, an unknown, repeated or missing field, or a wrong type;
/// [`Error::Invalid`] for fields that do not go together; [`Error::Core`] for values out of range
/// ([`Camera::check`]).
pub fn parse_camera_json(text: &str, path: &Path, default_near: f64) -> Result<Camera, Error> {
    let camera = camera(&from_json(text, path)?, path, default_near)?;
    check(&camera, path)?;
    Ok(camera)
}

/// Reads one camera as a set.
pub(super) fn read_one(text: &str, path: &Path, near: f64) -> Result<CameraSet, Error> {
    let json: CameraJson = from_json(text, path)?;
    let camera = camera(&json, path, near)?;
    check(&camera, path)?;
    let cameras = vec![NamedCamera::new(name_or_number(json.name, 0), camera, path)?];
    Ok(CameraSet { path: path.to_owned(), format: ONE, cameras, assumptions: Vec::new() })
}

/// The format of a file of one camera, in words.
const ONE: &str = "camera";

/// Reads a list of cameras.
pub(super) fn read_list(text: &str, path: &Path, near: f64) -> Result<CameraSet, Error> {
    let ListJson { cameras } = from_json(text, path)?;
    let cameras = cameras.into_iter().enumerate().map(|(index, json)| {
        let name = name_or_number(json.name.clone(), index);
        let camera = camera(&json, path, near).map_err(|error| error.of_camera(&name))?;
        NamedCamera::new(name, camera, path)
    });
    Ok(CameraSet {
        path: path.to_owned(),
        format: "list of cameras",
        cameras: cameras.collect::<Result<_, _>>()?,
        assumptions: Vec::new(),
    })
}

/// The camera that an object describes, its values unchecked.
fn camera(json: &CameraJson, path: &Path, default_near: f64) -> Result<Camera, Error> {
    let mut camera = Camera {
        width: json.width,
        height: json.height,
        projection: projection(json, path)?,
        principal_point: principal_point(json, path)?,
        world_to_camera: DMat4::from_cols_array_2d(&json.world_to_camera).transpose(),
        near: default_near,
        far: json.far.unwrap_or(f64::INFINITY),
        clip_planes: Vec::new(),
        distortion: distortion(json),
    };
    // Lengths given in scene units become those of the camera.
    let scale = camera.scale();
    camera.near = json.near.unwrap_or(default_near * scale);
    if let (Projection::Perspective { lens: Some(lens), .. }, Some(radius)) =
        (&mut camera.projection, json.lens_radius)
    {
        lens.radius = radius * scale;
    }
    Ok(camera)
}

/// The distortion; `None` if every coefficient is absent or 0.
fn distortion(json: &CameraJson) -> Option<Distortion> {
    let coefficient = |value: Option<f64>| value.unwrap_or(0.0);
    let distortion = Distortion {
        radial: [json.k1, json.k2, json.k3].map(coefficient),
        tangential: [json.p1, json.p2].map(coefficient),
    };
    Some(distortion).filter(|distortion| *distortion != Distortion::default())
}

/// The principal point: needed by a pinhole, else the middle of the frame unless given.
fn principal_point(json: &CameraJson, path: &Path) -> Result<DVec2, Error> {
    let coordinate = |field, value: Option<f64>, side: u32| match (value, json.model) {
        (Some(value), _) => Ok(value),
        (None, Model::Orthographic) => Ok(0.5 * f64::from(side)),
        (None, Model::Pinhole) => {
            Err(Error::invalid(path, Place::Field(field), "nothing", "a number: the model is pinhole"))
        }
    };
    Ok(DVec2::new(coordinate("cx", json.cx, json.width)?, coordinate("cy", json.cy, json.height)?))
}

fn projection(json: &CameraJson, path: &Path) -> Result<Projection, Error> {
    let needed = |field: &'static str, value: Option<f64>, why: &str| {
        value.ok_or_else(|| Error::invalid(path, Place::Field(field), "nothing", format!("a number: {why}")))
    };
    let unwanted = |fields: &[(&'static str, Option<f64>)], why: &str| {
        let found = fields.iter().find_map(|&(field, value)| Some((field, value?)));
        found.map_or(Ok(()), |(field, value)| {
            Err(Error::invalid(path, Place::Field(field), value.to_string(), format!("nothing: {why}")))
        })
    };
    match json.model {
        Model::Pinhole => {
            const WHY: &str = "the model is pinhole";
            unwanted(&[("pixels_per_unit", json.pixels_per_unit)], WHY)?;
            let focal_length = DVec2::new(needed("fx", json.fx, WHY)?, needed("fy", json.fy, WHY)?);
            Ok(Projection::Perspective { focal_length, lens: lens(json, path)? })
        }
        Model::Orthographic => {
            const WHY: &str = "the model is orthographic";
            let perspective =
                [("fx", json.fx), ("fy", json.fy), ("fstop", json.fstop), ("lens_radius", json.lens_radius)];
            let coefficients =
                [("k1", json.k1), ("k2", json.k2), ("k3", json.k3), ("p1", json.p1), ("p2", json.p2)];
            unwanted(&perspective, WHY)?;
            unwanted(&coefficients, WHY)?;
            let pixels_per_unit = needed("pixels_per_unit", json.pixels_per_unit, WHY)?;
            Ok(Projection::Orthographic { pixels_per_unit })
        }
    }
}

fn lens(json: &CameraJson, path: &Path) -> Result<Option<Lens>, Error> {
    if json.fstop.is_none() && json.lens_radius.is_none() {
        return Ok(None);
    }
    let positive = |field, value: f64| {
        let expected = "a number greater than 0";
        if value > 0.0 {
            Ok(value)
        } else {
            Err(Error::invalid(path, Place::Field(field), value.to_string(), expected))
        }
    };
    let Some(focus) = json.focus else {
        let expected = "the depth in focus (null for infinity), since there is a lens";
        return Err(Error::invalid(path, Place::Field("focus"), "nothing", expected));
    };
    let focus = positive("focus", focus.unwrap_or(f64::INFINITY))?;
    let blades = json.blades.unwrap_or(0);
    Ok(Some(match (json.lens_radius, json.fstop) {
        (Some(radius), _) => Lens { radius: positive("lens_radius", radius)?, focus, blades },
        (None, Some(fstop)) => Lens::from_fstop(positive("fstop", fstop)?, focus, blades),
        (None, None) => return Ok(None),
    }))
}

/// Writes a camera as a JSON file, in one step ([`AtomicFile`]). A lens is written by its radius.
///
/// # Errors
/// [`Error::Core`] if the camera is not valid; [`Error::Unsupported`] if it has clip planes, which the format
/// cannot hold; [`Error::Io`].
pub fn write_camera_json(path: &Path, camera: &Camera) -> Result<(), Error> {
    write_json(path, &json(path, None, camera)?)
}

/// Writes several cameras, with their names, as one JSON file; otherwise as [`write_camera_json`].
///
/// # Errors
/// As [`write_camera_json`].
pub fn write_cameras_json(path: &Path, cameras: &[NamedCamera]) -> Result<(), Error> {
    let cameras = cameras.iter().map(|named| json(path, Some(named.name.clone()), &named.camera));
    write_json(path, &ListJson { cameras: cameras.collect::<Result<_, _>>()? })
}

/// The object that describes a camera.
fn json(path: &Path, name: Option<String>, camera: &Camera) -> Result<CameraJson, Error> {
    check(camera, path)?;
    if !camera.clip_planes.is_empty() {
        return Err(Error::unsupported(path, "writing a camera with clip planes", "a camera without any"));
    }
    let finite = |value: f64| value.is_finite().then_some(value);
    let lens = camera.lens();
    let (focal_length, pixels_per_unit) = match camera.projection {
        Projection::Perspective { focal_length, .. } => (Some(focal_length), None),
        Projection::Orthographic { pixels_per_unit } => (None, Some(pixels_per_unit)),
    };
    let distortion = camera.distortion;
    let radial = |index: usize| distortion.map(|distortion| distortion.radial[index]);
    let tangential = |index: usize| distortion.map(|distortion| distortion.tangential[index]);
    Ok(CameraJson {
        name,
        model: if camera.is_orthographic() { Model::Orthographic } else { Model::Pinhole },
        width: camera.width,
        height: camera.height,
        fx: focal_length.map(|focal_length| focal_length.x),
        fy: focal_length.map(|focal_length| focal_length.y),
        pixels_per_unit,
        cx: Some(camera.principal_point.x),
        cy: Some(camera.principal_point.y),
        k1: radial(0),
        k2: radial(1),
        k3: radial(2),
        p1: tangential(0),
        p2: tangential(1),
        world_to_camera: camera.world_to_camera.transpose().to_cols_array_2d(),
        near: Some(camera.near),
        far: finite(camera.far),
        fstop: None,
        lens_radius: lens.map(|lens| lens.radius / camera.scale()),
        focus: lens.map(|lens| finite(lens.focus)),
        blades: lens.map(|lens| lens.blades).filter(|&blades| blades > 0),
    })
}

/// A camera as one line of JSON, as [`write_camera_json`] writes it; none if the format cannot hold it.
pub fn camera_json(camera: &Camera) -> Option<String> {
    serde_json::to_string(&json(Path::new("camera"), None, camera).ok()?).ok()
}

fn write_json(path: &Path, json: &impl Serialize) -> Result<(), Error> {
    let mut text =
        serde_json::to_string_pretty(json).map_err(|cause| Error::Json { path: path.to_owned(), cause })?;
    text.push('\n');
    let mut file = AtomicFile::create(path)?;
    file.write_all(text.as_bytes()).map_err(Error::io(path, "write"))?;
    file.commit()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, DVec4};

    const MATRIX: &str = r#""world_to_camera": [[1, 0, 0, 10], [0, 0, -1, 20], [0, 1, 0, 30], [0, 0, 0, 1]]"#;

    fn pinhole(more: &str) -> String {
        format!(
            r#"{{"model": "pinhole", "width": 640, "height": 480, "fx": 500, "fy": 501.5,
                 "cx": 320, "cy": 240, {MATRIX}{more}}}"#
        )
    }

    fn parse(text: &str) -> Result<Camera, Error> {
        parse_camera_json(text, Path::new("cam.json"), 0.25)
    }

    fn message(text: &str) -> String {
        let message = parse(text).unwrap_err().to_string();
        assert!(message.starts_with("cam.json: "), "{message}");
        message
    }

    #[test]
    fn a_pinhole_camera() {
        let camera = parse(&pinhole("")).unwrap();
        assert_eq!((camera.width, camera.height), (640, 480));
        let focal_length = DVec2::new(500.0, 501.5);
        assert_eq!(camera.projection, Projection::Perspective { focal_length, lens: None });
        assert_eq!((camera.near, camera.far), (0.25, f64::INFINITY));
        let p = camera.world_to_camera * DVec4::new(1.0, 2.0, 3.0, 1.0);
        assert_eq!(p, DVec4::new(11.0, 17.0, 32.0, 1.0));
        assert_eq!(camera.eye(), DVec3::new(-10.0, -30.0, 20.0));
    }

    #[test]
    fn lengths_in_scene_units_follow_the_matrix() {
        // A camera in millimetres for a scene in metres.
        let text = pinhole(r#", "lens_radius": 0.02, "focus": 3000"#).replace(
            "[1, 0, 0, 10], [0, 0, -1, 20], [0, 1, 0, 30]",
            "[1e3, 0, 0, 1], [0, 0, -1e3, 2], [0, 1e3, 0, 3]",
        );
        let camera = parse(&text).unwrap();
        let lens = camera.lens().unwrap();
        assert!((camera.near - 250.0).abs() < 1e-9 && (lens.radius - 20.0).abs() < 1e-12, "{camera:?}");
        assert_eq!(lens.focus, 3000.0);
    }

    #[test]
    fn an_orthographic_camera_looks_at_the_middle() {
        let text = format!(
            r#"{{"model": "orthographic", "width": 640, "height": 480, "pixels_per_unit": 10, {MATRIX}}}"#
        );
        assert_eq!(parse(&text).unwrap().principal_point, DVec2::new(320.0, 240.0));
    }

    #[test]
    fn depth_range() {
        let camera = parse(&pinhole(r#", "near": 1, "far": 9"#)).unwrap();
        assert_eq!((camera.near, camera.far), (1.0, 9.0));
        let camera = parse(&pinhole(r#", "near": null, "far": null"#)).unwrap();
        assert_eq!((camera.near, camera.far), (0.25, f64::INFINITY));
        assert!(message(&pinhole(r#", "near": 2, "far": 1"#)).contains("camera far"));
        assert!(message(&pinhole(r#", "near": 0"#)).contains("camera near"));
    }

    #[test]
    fn lenses() {
        let lens = |more| parse(&pinhole(more)).unwrap().lens();
        assert_eq!(lens(r#", "focus": 4"#), None);
        assert_eq!(lens(r#", "fstop": 2, "focus": 4"#), Some(Lens::from_fstop(2.0, 4.0, 0)));
        let far = Lens { radius: 0.25, focus: f64::INFINITY, blades: 6 };
        assert_eq!(lens(r#", "fstop": 2, "focus": null, "blades": 6"#), Some(far));
        let given = Lens { radius: 0.125, focus: 3.0, blades: 0 };
        assert_eq!(lens(r#", "fstop": 2, "focus": 3, "lens_radius": 0.125"#), Some(given));
        for more in [r#", "fstop": 2"#, r#", "lens_radius": 2"#] {
            assert!(message(&pinhole(more)).contains("field focus: found nothing, expected the depth"));
        }
        for (more, field) in [
            (r#", "fstop": 0, "focus": 1"#, "field fstop: found 0"),
            (r#", "fstop": 1, "focus": 0"#, "field focus: found 0"),
            (r#", "lens_radius": -1, "focus": 1"#, "field lens_radius: found -1"),
            (r#", "fstop": 1, "focus": 1, "blades": 2"#, "lens blades"),
        ] {
            assert!(message(&pinhole(more)).contains(field), "{}", message(&pinhole(more)));
        }
    }

    #[test]
    fn an_orthographic_camera() {
        let text = |more: &str| {
            format!(
                r#"{{"model": "orthographic", "width": 4, "height": 3, "cx": 2, "cy": 1.5, {MATRIX}{more}}}"#
            )
        };
        let camera = parse(&text(r#", "pixels_per_unit": 7, "near": 0"#)).unwrap();
        assert_eq!(camera.projection, Projection::Orthographic { pixels_per_unit: 7.0 });
        assert!(message(&text("")).contains("field pixels_per_unit: found nothing"));
        let both = message(&text(r#", "pixels_per_unit": 7, "fx": 1"#));
        assert!(both.contains("field fx: found 1, expected nothing: the model is orthographic"), "{both}");
        assert!(message(&text(r#", "pixels_per_unit": 7, "fstop": 1"#)).contains("field fstop"));
    }

    #[test]
    fn mistakes_are_named_with_their_place() {
        let unknown = message(&pinhole(",\n\"fov\": 40"));
        assert!(
            unknown.contains("unknown field `fov`, expected one of `name`, `model`, `width`"),
            "{unknown}"
        );
        assert!(unknown.contains("line 3 column"), "{unknown}");
        assert!(message(&pinhole(r#", "cx": 1"#)).contains("duplicate field `cx`"));
        assert!(message(&pinhole("").replace("\"cx\": 320,", "")).contains("cx: found nothing"));
        assert!(message(&pinhole("").replace("\"fx\": 500,", "")).contains("field fx: found nothing"));
        assert!(message(&pinhole("").replace("640", "-1")).contains("expected u32"));
        assert!(message(&pinhole("").replace("640", "0")).contains("camera width: found 0"));
        assert!(message(&pinhole("").replace("500", "-5")).contains("camera fx"));
        assert!(message(&pinhole("").replace("pinhole", "fisheye")).contains("unknown variant `fisheye`"));
        assert!(message(&pinhole("").replace("[0, 0, 0, 1]", "[0, 0, 0]")).contains("invalid length 3"));
        assert!(message(&pinhole("").replace("[0, 0, 0, 1]", "[0, 0, 1, 1]")).contains("last row 0 0 0 1"));
        assert!(message(&pinhole("").replace("500", "1e999")).contains("number out of range"));
        assert!(message("").contains("EOF"));
        assert!(message(&(pinhole("") + "x")).contains("trailing characters"));
    }

    #[test]
    fn what_is_written_reads_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cam.json");
        for more in [
            "",
            r#", "far": 9"#,
            r#", "fstop": 2.8, "focus": null, "blades": 5"#,
            r#", "fstop": 3, "focus": 0.1"#,
        ] {
            let mut camera = parse(&pinhole(more)).unwrap();
            camera.world_to_camera.w_axis.x = 500_000.123_456_789;
            camera.near = 1.0 / 3.0;
            write_camera_json(&path, &camera).unwrap();
            assert_eq!(read_camera_json(&path, 77.0).unwrap(), camera);
        }
        let mut camera = parse(&pinhole("")).unwrap();
        camera.projection = Projection::Orthographic { pixels_per_unit: 0.1 };
        write_camera_json(&path, &camera).unwrap();
        assert_eq!(read_camera_json(&path, 77.0).unwrap(), camera);

        camera.clip_planes.push(DVec4::X);
        assert!(write_camera_json(&path, &camera).unwrap_err().to_string().contains("clip planes"));
    }

    #[test]
    fn a_file_that_is_missing_or_too_long() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cam.json");
        assert!(read_camera_json(&path, 1.0).unwrap_err().to_string().contains("cam.json: cannot open"));
        std::fs::write(&path, " ".repeat(2 << 20)).unwrap();
        assert!(read_camera_json(&path, 1.0).unwrap_err().to_string().contains("limit of 1 MiB"));
        std::fs::write(&path, b"{\"\xff").unwrap();
        assert!(read_camera_json(&path, 1.0).unwrap_err().to_string().contains("byte 2: found `\\xff`"));
    }
}

//! Readers, and what is done with what they read.

use crate::damaged::{model_of_binary, model_of_text};
use splat_core::fit::{Framing, Up, fit};
use splat_core::prepare::{PrepareOptions, prepare};
use splat_core::texture::pyramid::Wrap;
use splat_core::{Cloud, RenderOptions, render};
use splat_io::{
    CameraDefaults, Error, Import, MeshImport, parse_camera_json, parse_cameras, parse_scene, read_cameras,
    read_las_from, read_pcd_from, read_ply_from, read_ply_mesh_from, read_points3d, read_pyramid_from,
    read_splat_from, read_spz_from, read_text_from, sample_surface,
};
use std::fs;
use std::io::Cursor;
use std::path::Path;

/// Greatest length of an error's text, in bytes: a person has to read it.
const MOST_MESSAGE: usize = 1000;

/// Clouds of more points are not drawn: other bodies find what is wrong with drawing faster.
const MOST_DRAWN: usize = 64;

/// A value, or none after an error that has been looked at.
fn value<T>(result: Result<T, Error>) -> Option<T> {
    let error = match result {
        Ok(value) => return Some(value),
        Err(error) => error.to_string(),
    };
    assert!(!error.is_empty() && error.len() <= MOST_MESSAGE, "{} bytes: {error}", error.len());
    let is_raw = error.chars().any(char::is_control);
    assert!(!is_raw, "control characters: {error:?}");
    None
}

/// Checks a cloud, completes it as `splat render` does, and draws it.
fn cloud(result: Result<Import, Error>) {
    let Some(Import { mut cloud, report }) = value(result) else { return };
    assert_eq!(cloud.check_lengths(), Ok(()));
    assert!(report.elements.iter().any(|element| element.is_points));
    if !cloud.is_empty() && cloud.len() <= MOST_DRAWN {
        let options = RenderOptions { samples: 1, ..RenderOptions::suited_to(&cloud) };
        prepare(&mut cloud, &PrepareOptions::for_picture(&options), &mut |_| {});
        draw(&cloud, &options);
    }
}

fn draw(cloud: &Cloud, options: &RenderOptions) {
    let framing =
        Framing { width: 8, height: 8, up: Up::Y, azimuth: 30.0, elevation: 20.0, ..Framing::default() };
    let Ok(camera) = fit(cloud, &framing, options) else { return };
    if let Ok(rendered) = render(cloud, &camera, options, &mut |_| {}) {
        assert!(rendered.film.rgba.as_flattened().iter().all(|value| value.is_finite()));
    }
}

fn mesh(result: Result<MeshImport, Error>) {
    let Some(MeshImport { mesh, .. }) = value(result) else { return };
    mesh.check().expect("a mesh from a file belongs together");
    if mesh.triangles.len() <= 1000
        && let Ok(sampled) = sample_surface(&mesh, 16, 0, &mut |_| {})
    {
        assert_eq!(sampled.cloud.check_lengths(), Ok(()));
    }
}

pub(super) fn ply(bytes: &[u8]) {
    let path = Path::new("x.ply");
    cloud(read_ply_from(bytes, bytes.len() as u64, path));
    mesh(read_ply_mesh_from(bytes, bytes.len() as u64, path));
}

pub(super) fn las(bytes: &[u8]) {
    cloud(read_las_from(bytes, Path::new("x.las")));
}

pub(super) fn pcd(bytes: &[u8]) {
    cloud(read_pcd_from(bytes, Path::new("x.pcd")));
}

pub(super) fn text(bytes: &[u8]) {
    cloud(read_text_from(bytes, Path::new("x.xyz"), None));
    let columns = ["x", "y", "z", "-", "radius", "nx"].map(str::to_owned);
    cloud(read_text_from(bytes, Path::new("x.pts"), Some(&columns)));
}

pub(super) fn splat(bytes: &[u8]) {
    cloud(read_splat_from(bytes, bytes.len() as u64, Path::new("x.splat")));
}

pub(super) fn spz(bytes: &[u8]) {
    cloud(read_spz_from(bytes, bytes.len() as u64, Path::new("x.spz")));
}

pub(super) fn obj(bytes: &[u8]) {
    mesh(splat_io::mesh::read_obj_from(bytes, bytes.len() as u64, Path::new("x.obj")));
}

/// Puts files into a folder of their own, for readers that want a folder.
fn in_folder(files: &[(&str, &[u8])], read: impl FnOnce(&Path)) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).expect("a file in a temporary folder");
    }
    read(folder.path());
}

pub(super) fn points3d_text(bytes: &[u8]) {
    in_folder(&[("points3D.txt", bytes)], |folder| cloud(read_points3d(&folder.join("points3D.txt"))));
}

pub(super) fn points3d_binary(bytes: &[u8]) {
    in_folder(&[("points3D.bin", bytes)], |folder| cloud(read_points3d(&folder.join("points3D.bin"))));
}

/// Reads a COLMAP model, whose two files stand in these bytes.
fn colmap(files: [(&str, &[u8]); 2]) {
    in_folder(&files, |folder| {
        value(read_cameras(folder, 0.1));
    });
}

pub(super) fn colmap_text(bytes: &[u8]) {
    colmap(model_of_text(bytes));
}

pub(super) fn colmap_binary(bytes: &[u8]) {
    colmap(model_of_binary(bytes));
}

pub(super) fn cameras(bytes: &[u8]) {
    let Ok(text) = str::from_utf8(bytes) else { return };
    let defaults = CameraDefaults { near: 0.1, size: None, intrinsic: None };
    if let Some(set) = value(parse_cameras(text, Path::new("x.json"), &defaults)) {
        for camera in set.cameras {
            camera.camera.check().expect("a camera from a file is a good one");
        }
    }
}

pub(super) fn camera_json(bytes: &[u8]) {
    let Ok(text) = str::from_utf8(bytes) else { return };
    if let Some(camera) = value(parse_camera_json(text, Path::new("x.json"), 0.1)) {
        camera.check().expect("a camera from a file is a good one");
    }
}

pub(super) fn scene(bytes: &[u8]) {
    let Ok(text) = str::from_utf8(bytes) else { return };
    value(parse_scene(text, Path::new("x.toml")));
}

pub(super) fn texture(bytes: &[u8]) {
    let wrap = [Wrap::Repeat, Wrap::Clamp];
    let Some(pyramid) =
        value(read_pyramid_from(Cursor::new(bytes), bytes.len() as u64, Path::new("x.png"), wrap))
    else {
        return;
    };
    let coarsest = pyramid.levels().last().expect("a pyramid has a level");
    assert_eq!(coarsest.size(), [1, 1]);
}

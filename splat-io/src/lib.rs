//! Clouds, cameras and pictures in and out of files, textures in.
//!
//! Every byte of input is taken as hostile: a size that a file claims is held against the size that the file
//! has before anything is allocated, and whatever is wrong becomes an [`Error`] that says where it is, what
//! was found and what was expected. An output file is absent, old, or complete ([`AtomicFile`]).

#![forbid(unsafe_code)]

pub mod atomic;
pub mod cameras;
pub mod checkpoint;
pub mod cloud_file;
#[cfg(test)]
mod damage;
pub mod decimals;
pub mod error;
pub mod exr_file;
pub mod flip;
pub mod import;
pub mod las;
mod lines;
pub mod memory;
pub mod merge;
pub mod mesh;
pub mod metadata;
pub mod pcd;
pub mod picture;
pub mod ply;
pub mod png_file;
pub mod png_picture;
pub mod points3d;
pub mod scene_file;
mod source;
pub mod srgb;
mod table;
pub mod text;
pub mod texture_file;
pub mod trained;
mod whole_file;

pub use atomic::AtomicFile;
pub use cameras::{
    CameraDefaults, CameraSet, NamedCamera, camera_json, parse_camera_json, parse_cameras, read_camera_json,
    read_cameras, read_cameras_with, write_camera_json, write_cameras_json,
};
pub use checkpoint::{Identity, hash_file, hash_text, read_checkpoint, write_checkpoint};
pub use cloud_file::{CloudFormat, CloudOptions, CloudTarget, cloud_format, read_cloud, write_cloud};
pub use decimals::decimals;
pub use error::{Error, Place};
pub use exr_file::picture::{ExrPicture, Values, read_exr, write_exr_picture};
pub use exr_file::{Compression, ExrOptions, write_aov_files, write_exr};
pub use flip::flip;
pub use import::{ElementReport, Import, ImportReport, Loss, PropertyReport, Usage};
pub use las::{read_las, read_las_from, write_las};
pub use merge::{MergeError, Piece, merge};
pub use mesh::{Mesh, MeshImport, Sampled, read_obj, sample_surface};
pub use metadata::Metadata;
pub use pcd::{read_pcd, read_pcd_from};
pub use picture::{PictureFormat, PictureOptions, write_picture};
pub use ply::{
    PlyEncoding, ply_has_faces, read_ply, read_ply_from, read_ply_mesh, read_ply_mesh_from, write_ply,
};
pub use png_file::{PngDepth, write_png};
pub use png_picture::{PngPicture, read_png};
pub use points3d::read_points3d;
pub use scene_file::{SceneFile, parse_scene, read_scene};
pub use text::{read_text, read_text_from, write_text};
pub use texture_file::{read_pyramid, read_pyramid_from};
pub use trained::{read_splat, read_splat_from, read_spz, read_spz_from, write_splat};
pub use whole_file::file_sha256;

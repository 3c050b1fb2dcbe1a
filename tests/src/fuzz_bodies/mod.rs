//! What must hold for any bytes whatever, body by body: a reader ends with a value or an error that can be shown, a kernel
//! with numbers in range, and the fast core with the reference's bits. A body that finds otherwise panics.
//!
//! The same bodies are run by the fuzz targets in `fuzz/`, which choose the bytes, and by ordinary tests, which take
//! them from [`crate::damaged`] and from seeded random numbers.

mod decode;
mod kernels;
mod readers;

use std::fmt;

/// Something that is done with any bytes.
#[derive(Clone, Copy)]
pub struct Body {
    /// Its name, that of its fuzz target.
    pub name: &'static str,
    /// Panics if something that must hold does not.
    pub run: fn(&[u8]),
}

impl fmt::Debug for Body {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

const fn body(name: &'static str, run: fn(&[u8])) -> Body {
    Body { name, run }
}

/// The bodies that take the bytes for a file.
pub const READERS: [Body; 15] = [
    body("ply", readers::ply),
    body("las", readers::las),
    body("pcd", readers::pcd),
    body("text", readers::text),
    body("splat", readers::splat),
    body("spz", readers::spz),
    body("obj", readers::obj),
    body("points3d_text", readers::points3d_text),
    body("points3d_binary", readers::points3d_binary),
    body("colmap_text", readers::colmap_text),
    body("colmap_binary", readers::colmap_binary),
    body("cameras", readers::cameras),
    body("camera_json", readers::camera_json),
    body("scene", readers::scene),
    body("texture", readers::texture),
];

/// The bodies that decode numbers from the bytes.
pub const KERNELS: [Body; 4] = [
    body("resolve", kernels::resolve),
    body("footprint", kernels::footprint),
    body("lookup", kernels::lookup),
    body("cores", kernels::cores),
];

/// The body of a name.
pub fn find(name: &str) -> Option<Body> {
    READERS.into_iter().chain(KERNELS).find(|body| body.name == name)
}

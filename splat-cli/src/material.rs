//! From options to the material: textures and surroundings.

use crate::arguments::MaterialArguments;
use crate::choices::MappingChoice;
use crate::console::Console;
use crate::memory::Memory;
use crate::usage::UsageError;
use anyhow::ensure;
use glam::{DAffine3, DMat3, DVec2, DVec3};
use splat_core::Cloud;
use splat_core::fit::Up;
use splat_core::shade::{Environment, Material, Optics};
use splat_core::texture::{
    CylinderHeight, CylindricalMapping, ImageTexture, Mapping, PlanarMapping, Pyramid, Sampler,
    SphericalMapping, Texture, UvMapping, Wrap,
};
use splat_io::{file_sha256, read_pyramid};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Checks what can be checked before anything is read.
///
/// # Errors
/// Options that say nothing, or too little, without another.
pub fn check(arguments: &MaterialArguments) -> Result<(), UsageError> {
    let MaterialArguments {
        texture,
        mapping,
        texture_wrap,
        texture_repeat,
        environment,
        reflect,
        refract,
        ..
    } = arguments;
    let given = [
        ("--mapping", mapping.is_some()),
        ("--texture-wrap", texture_wrap.is_some()),
        ("--texture-repeat", texture_repeat.is_some()),
    ];
    if let (None, Some((name, _))) = (texture, given.iter().find(|(_, is_given)| *is_given)) {
        return Err(UsageError::new(format!("{name} says nothing without --texture IMAGE")));
    }
    match (environment, *reflect || refract.is_some()) {
        (None, true) => Err(UsageError::new("--reflect and --refract need --environment IMAGE")),
        _ => Ok(()),
    }
}

/// The images of a material.
#[derive(Debug, Clone)]
pub struct Images {
    texture: Option<Arc<Pyramid>>,
    environment: Option<Arc<Pyramid>>,
    /// SHA-256 of their files.
    pub hashes: Vec<String>,
}

/// Reads the images; before the clouds, which take longer.
///
/// # Errors
/// Images that cannot be read, or take too much memory, and, to the strict, those with values that are not finite.
pub fn read(
    arguments: &MaterialArguments,
    strict: bool,
    memory: Memory,
    console: Console,
) -> anyhow::Result<Images> {
    let wrap: Wrap = arguments.texture_wrap.unwrap_or_default().into();
    let read = |path: &Option<PathBuf>, wrap| {
        path.as_ref().map(|path| image(path, wrap, strict, memory, console)).transpose()
    };
    let texture = read(&arguments.texture, [wrap; 2])?;
    let environment = read(&arguments.environment, [Wrap::Repeat, Wrap::Clamp])?;
    // Last: what is refused may be a terabyte.
    let hashes = arguments.images().map(|path| file_sha256(path)).collect::<Result<_, _>>()?;
    Ok(Images { hashes, texture, environment })
}

/// Lays the images on a prepared cloud whose up axis is `up`.
///
/// # Errors
/// A mapping that the cloud has no coordinates for.
pub fn material(
    arguments: &MaterialArguments,
    images: Images,
    cloud: &Cloud,
    up: Up,
) -> Result<Material, UsageError> {
    let mut material = Material { detail: arguments.texture_detail.into(), ..Material::default() };
    if let Some(pyramid) = images.texture {
        let mapping = mapping(arguments, cloud, up)?;
        let image = ImageTexture { pyramid, sampler: sampler(arguments), mapping };
        material.texture = Some(Arc::new(Texture::Image(image)));
    }
    if let Some(image) = images.environment {
        let [up, front, _] = up.axes();
        // The middle of the image is what someone sees who looks at the front.
        let optics = arguments.refract.map_or(Optics::Reflect, Optics::Refract);
        let environment = Environment::new(image, sampler(arguments), axes(front, up), optics);
        material.environment = Some(Arc::new(environment));
    }
    Ok(material)
}

/// Reads an image, and warns of texels that are no numbers, or refuses them.
fn image(
    path: &Path,
    wrap: [Wrap; 2],
    strict: bool,
    memory: Memory,
    console: Console,
) -> anyhow::Result<Arc<Pyramid>> {
    memory.check_image(path)?;
    let pyramid = read_pyramid(path, wrap)?;
    if let count @ 1.. = pyramid.replaced() {
        ensure!(!strict, "{}: --strict: {count} values that are not finite", path.display());
        console.warn(format_args!("{}: values replaced that are not finite: {count}", path.display()));
    }
    Ok(Arc::new(pyramid))
}

fn sampler(arguments: &MaterialArguments) -> Sampler {
    Sampler {
        filter: arguments.texture_filter.into(),
        max_anisotropy: arguments.max_anisotropy,
        ..Sampler::default()
    }
}

/// Where the texture lies.
fn mapping(arguments: &MaterialArguments, cloud: &Cloud, up: Up) -> Result<Mapping, UsageError> {
    let choice = arguments.mapping.unwrap_or_default();
    if choice == MappingChoice::Uv {
        if cloud.texture_coordinates.is_none() {
            return Err(UsageError::new(
                "the cloud has no texture coordinates: add --mapping spherical, cylindrical or planar",
            ));
        }
        let scale = arguments.texture_repeat.map_or(DVec2::ONE, DVec2::from);
        return Ok(Mapping::Uv(UvMapping { scale, offset: DVec2::ZERO }));
    }
    if arguments.texture_repeat.is_some() {
        return Err(UsageError::new("--texture-repeat needs --mapping uv"));
    }
    let (low, high) = cloud.bounds().unwrap_or_default();
    let middle = 0.5 * (low + high);
    let [up, front, side] = up.axes();
    let extent = |axis: DVec3| (high - low).dot(axis).abs().max(f64::MIN_POSITIVE);
    Ok(match choice {
        // The front shows the middle of the image, which is at -x.
        MappingChoice::Spherical | MappingChoice::Uv => Mapping::Spherical(SphericalMapping {
            world_to_texture: DAffine3::from_mat3(axes(-front, up)) * DAffine3::from_translation(-middle),
        }),
        // Here it is at +x. The image is as high as the cloud.
        MappingChoice::Cylindrical => Mapping::Cylindrical(CylindricalMapping {
            world_to_texture: DAffine3::from_scale(DVec3::splat(1.0 / extent(up)))
                * DAffine3::from_mat3(axes(front, up))
                * DAffine3::from_translation(0.5 * extent(up) * up - middle),
            height: CylinderHeight::AlongAxis,
        }),
        // The image as seen from the front, as large as the cloud.
        MappingChoice::Planar => {
            let (vs, vt) = (side / extent(side), up / extent(up));
            Mapping::Planar(PlanarMapping {
                world_to_texture: DAffine3::from_translation(-middle),
                vs,
                vt,
                offset: DVec2::splat(0.5),
            })
        }
    })
}

/// To a right-handed frame with these directions for x and z.
fn axes(x: DVec3, z: DVec3) -> DMat3 {
    DMat3::from_cols(x, z.cross(x), z).transpose()
}

/// The options of a material in words, as the command line has them.
pub fn describe(arguments: &MaterialArguments) -> String {
    let mut text = String::new();
    let MaterialArguments { texture, environment, refract, max_anisotropy, .. } = arguments;
    if let Some(texture) = texture {
        let mapping = crate::choices::word(&arguments.mapping.unwrap_or_default());
        let filter = crate::choices::word(&arguments.texture_filter);
        let wrap = crate::choices::word(&arguments.texture_wrap.unwrap_or_default());
        _ = write!(
            text,
            " --texture {} --mapping {mapping} --texture-wrap {wrap} --texture-filter {filter} --max-anisotropy {max_anisotropy}",
            texture.display(),
        );
        if let Some([s, t]) = arguments.texture_repeat {
            _ = write!(text, " --texture-repeat {s},{t}");
        }
    }
    if let Some(environment) = environment {
        _ = write!(text, " --environment {}", environment.display());
        match refract {
            Some(index) => _ = write!(text, " --refract {index}"),
            None => text.push_str(" --reflect"),
        }
    }
    if texture.is_some() || environment.is_some() {
        _ = write!(text, " --texture-detail {}", crate::choices::word(&arguments.texture_detail));
    }
    text
}

//! The splat shader (L161-162): from the cloud's colours, textures and surroundings to the colour of a splat, or of a splat
//! in a pixel.

mod materials;
mod splat;

pub use materials::Materials;
pub use splat::{Shaded, ShadedSplat, Sight, SplatShader};

use crate::texture::{
    ImageTexture, Mapping, Pyramid, RayDifferential, Sampler, SpacePoint, SphericalMapping, Surface,
    SurfacePoint, Texture,
};
use glam::{DAffine3, DMat3, DVec3};
use std::fmt;
use std::sync::Arc;

/// What colours a surface besides the cloud's own colours. The default is nothing, and costs nothing.
#[derive(Clone, Default)]
pub struct Material {
    /// In place of the cloud's colours.
    pub texture: Option<Arc<Texture>>,
    /// How often textures and surroundings are looked up.
    pub detail: Detail,
    /// What the surface shows of its surroundings, in place of its colour.
    pub environment: Option<Arc<Environment>>,
    /// Has the last word on the colour.
    pub shader: Option<Arc<Shader>>,
}

/// A caller's shader: given a point and the linear colour there, lit, the colour that it shall have.
pub type Shader = dyn Fn(&ShadedPoint, [f32; 3]) -> [f32; 3] + Send + Sync;

/// A point of a surface as a shader sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShadedPoint {
    /// Where it is, in the world and on the texture, and how that changes from pixel to pixel.
    pub surface: SurfacePoint,
    /// Unit normal, in the world, on the viewer's side.
    pub normal: DVec3,
    /// Whether that is the splat's back.
    pub back: bool,
    /// The rays from the viewer; their directions are of unit length.
    pub ray: RayDifferential,
    /// Index of the splat in the cloud.
    pub index: usize,
}

/// How often textures and surroundings are looked up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Detail {
    /// Once a splat and pixel; splats smaller than half a pixel once.
    #[default]
    Fragment,
    /// Once a splat.
    Splat,
}

impl Material {
    /// Nothing but the cloud's colours.
    pub const PLAIN: Self = Self { texture: None, detail: Detail::Fragment, environment: None, shader: None };

    /// Whether there is nothing but the cloud's colours.
    pub fn is_plain(&self) -> bool {
        self.texture.is_none() && self.environment.is_none() && self.shader.is_none()
    }

    /// The only image that decides what colour a splat has, if that is so.
    pub fn image(&self) -> Option<&ImageTexture> {
        match (self.environment.as_deref(), self.texture.as_deref()) {
            (Some(environment), _) => Some(environment.image()),
            (None, Some(Texture::Image(image))) => Some(image),
            _ => None,
        }
    }

    /// All images.
    pub fn images(&self) -> Vec<&ImageTexture> {
        let mut images = Vec::new();
        if let Some(texture) = &self.texture {
            texture.collect_images(&mut images);
        }
        images.extend(self.environment.as_deref().map(Environment::image));
        images
    }

    /// Whether a splat's colour differs from pixel to pixel.
    pub fn varies_by_pixel(&self) -> bool {
        !self.is_plain() && self.detail == Detail::Fragment
    }
}

/// Two materials are equal if they share what they are made of.
impl PartialEq for Material {
    fn eq(&self, other: &Self) -> bool {
        fn same<T: ?Sized>(a: &Option<Arc<T>>, b: &Option<Arc<T>>) -> bool {
            a.as_ref().map(|a| Arc::as_ptr(a).cast::<()>()) == b.as_ref().map(|b| Arc::as_ptr(b).cast::<()>())
        }
        same(&self.texture, &other.texture)
            && self.detail == other.detail
            && same(&self.environment, &other.environment)
            && same(&self.shader, &other.shader)
    }
}

impl fmt::Debug for Material {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Material")
            .field("texture", &self.texture)
            .field("detail", &self.detail)
            .field("environment", &self.environment)
            .field("shader", &self.shader.as_ref().map(|_| "a closure"))
            .finish()
    }
}

/// How surroundings are seen in a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Optics {
    /// As in a mirror.
    Reflect,
    /// Through it, into a medium with this index of refraction relative to the viewer's, 1.5 for glass; where a back is
    /// seen, out of it. Total reflection mirrors.
    Refract(f64),
}

/// Surroundings, infinitely far away: an image of all directions, by longitude and latitude.
#[derive(Debug, Clone)]
pub struct Environment {
    image: ImageTexture,
    optics: Optics,
}

impl Environment {
    /// Surroundings seen by `optics` in an image whose upper edge is straight up. `world_to_image` turns the world's
    /// directions to those of the image, whose up is +z, and whose middle column is -x; who looks there has +y at the right.
    pub fn new(image: Arc<Pyramid>, sampler: Sampler, world_to_image: DMat3, optics: Optics) -> Self {
        // A texture's longitude runs to the right as a globe shows it from outside; this is seen from inside.
        let inside = DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0));
        let world_to_texture = DAffine3::from_mat3(inside * world_to_image);
        let mapping = Mapping::Spherical(SphericalMapping { world_to_texture });
        Self { image: ImageTexture { pyramid: image, sampler, mapping }, optics }
    }

    /// How they are seen.
    pub fn optics(&self) -> Optics {
        self.optics
    }

    /// The image, whose points are directions.
    pub fn image(&self) -> &ImageTexture {
        &self.image
    }

    /// The direction in which the viewer's rays go on from a point with this unit normal. `back` if they meet the inside.
    fn direction(&self, point: DVec3, normal: DVec3, back: bool, rays: &RayDifferential) -> SurfacePoint {
        // Of a splat no more is known than its plane.
        let flat = [DVec3::ZERO; 2];
        let surface =
            Surface { position: point, normal, position_derivatives: flat, normal_derivatives: flat };
        let differentials = surface.differentials(rays);
        let seen = match self.optics {
            Optics::Reflect => None,
            Optics::Refract(index) => {
                rays.refracted(&surface, &differentials, if back { index } else { 1.0 / index })
            }
        };
        let seen = seen.unwrap_or_else(|| rays.reflected(&surface, &differentials));
        let point = seen.ray.direction;
        let [dx, dy] = seen.next.map(|next| next.direction - point);
        SurfacePoint { space: SpacePoint { point, dx, dy }, ..SurfacePoint::default() }
    }
}

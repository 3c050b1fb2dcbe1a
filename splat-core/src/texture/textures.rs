//! Textures: constants, images, functions, and textures made of other textures. Seed 3, sections 11.1 and 11.3.

use super::filter::Sampler;
use super::footprint::{Footprint, PixelDerivatives};
use super::function::TextureFunction;
use super::mapping::{
    CylindricalMapping, PlanarMapping, SolidMapping, SpacePoint, SphericalMapping, TexturePoint, UvMapping,
};
use super::pyramid::Pyramid;
use glam::{DVec2, Vec2};
use std::fmt;
use std::sync::Arc;

/// A point of a surface at which a texture is looked up.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SurfacePoint {
    /// The surface's own texture coordinates there. (0, 0) is the lower left corner of an image.
    pub own: TexturePoint,
    /// The point itself, in the world.
    pub space: SpacePoint,
}

/// From a point of a surface to texture coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mapping {
    /// The surface's own coordinates.
    Uv(UvMapping),
    /// Around a sphere. As images of the whole sky are laid out: s is the longitude, t the latitude, up to 1 at the pole
    /// on +z.
    Spherical(SphericalMapping),
    /// Around a cylinder.
    Cylindrical(CylindricalMapping),
    /// Onto a plane.
    Planar(PlanarMapping),
}

impl Mapping {
    /// The surface's own coordinates as they are.
    pub const OWN: Self = Self::Uv(UvMapping { scale: DVec2::ONE, offset: DVec2::ZERO });

    /// The texture coordinates of a point.
    pub fn map(&self, at: &SurfacePoint) -> TexturePoint {
        match self {
            Self::Uv(mapping) => mapping.map(at.own.st, &at.own.derivatives),
            Self::Spherical(mapping) => latitude_upwards(mapping.map(&at.space)),
            Self::Cylindrical(mapping) => mapping.map(&at.space),
            Self::Planar(mapping) => mapping.map(&at.space),
        }
    }
}

/// From the seed's (polar angle, longitude) to (longitude, latitude), the way images lie.
fn latitude_upwards(TexturePoint { st, derivatives }: TexturePoint) -> TexturePoint {
    let turn = |change: DVec2| DVec2::new(change.y, -change.x);
    TexturePoint {
        st: DVec2::new(st.y, 1.0 - st.x),
        derivatives: PixelDerivatives { x: turn(derivatives.x), y: turn(derivatives.y) },
    }
}

/// An image on a surface.
#[derive(Debug, Clone)]
pub struct ImageTexture {
    /// The image. One channel is grey; alpha is left aside.
    pub pyramid: Arc<Pyramid>,
    /// How it is filtered.
    pub sampler: Sampler,
    /// Where it lies.
    pub mapping: Mapping,
}

impl ImageTexture {
    /// Where the image is looked up for a point: its rows run downwards, t upwards.
    pub fn place(&self, at: &SurfacePoint) -> (Vec2, Footprint) {
        let TexturePoint { st, derivatives } = self.mapping.map(at);
        let downwards = Vec2::new(1.0, -1.0);
        let semi_axes = derivatives.semi_axes().semi_axes.map(|axis| axis * downwards);
        (DVec2::new(st.x, 1.0 - st.y).as_vec2(), Footprint { semi_axes })
    }

    /// The colour that a looked up texel stands for.
    pub fn color_of(&self, [red, green, blue, _]: [f32; 4]) -> [f32; 3] {
        if self.pyramid.channels() < 3 { [red; 3] } else { [red, green, blue] }
    }

    /// The mean linear colour around a point.
    pub fn color(&self, at: &SurfacePoint, images: &dyn ImageLookup) -> [f32; 3] {
        let (st, footprint) = self.place(at);
        self.color_of(images.lookup(self, st, &footprint))
    }
}

/// Whoever averages images over footprints: the filters of this crate, or faster ones.
pub trait ImageLookup: Sync + fmt::Debug {
    /// The mean of an image around `st`, as [`Sampler::lookup`] gives it.
    fn lookup(&self, image: &ImageTexture, st: Vec2, footprint: &Footprint) -> [f32; 4];
}

/// The filters of this crate.
#[derive(Debug, Clone, Copy, Default)]
pub struct ScalarLookup;

impl ImageLookup for ScalarLookup {
    fn lookup(&self, image: &ImageTexture, st: Vec2, footprint: &Footprint) -> [f32; 4] {
        image.sampler.lookup(&image.pyramid, st, footprint)
    }
}

/// Where a function of space is evaluated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Placement {
    /// At texture coordinates, as points of the plane z = 0.
    Plane(Mapping),
    /// In the world, moved.
    Solid(SolidMapping),
}

/// A function as a mix of two colours: at 0 the first, at 1 the second.
#[derive(Clone)]
pub struct FunctionTexture {
    /// The function.
    pub function: Arc<dyn TextureFunction + Send + Sync>,
    /// Where it is evaluated.
    pub placement: Placement,
    /// Linear colours.
    pub colors: [[f32; 3]; 2],
}

impl fmt::Debug for FunctionTexture {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { placement, colors, .. } = self;
        f.debug_struct("FunctionTexture").field("placement", placement).field("colors", colors).finish()
    }
}

impl FunctionTexture {
    fn color(&self, at: &SurfacePoint) -> [f32; 3] {
        let place = match &self.placement {
            Placement::Plane(mapping) => {
                let TexturePoint { st, derivatives } = mapping.map(at);
                SpacePoint::in_plane(st, &derivatives.semi_axes())
            }
            Placement::Solid(mapping) => mapping.map(&at.space),
        };
        mix(self.colors[0], self.colors[1], [self.function.filtered(&place) as f32; 3])
    }
}

/// A texture: a colour for every point of a surface, averaged over a pixel's footprint.
#[derive(Debug, Clone)]
pub enum Texture {
    /// The same everywhere.
    Constant([f32; 3]),
    /// An image.
    Image(ImageTexture),
    /// A function.
    Function(FunctionTexture),
    /// The product of two textures.
    Scale(Arc<Self>, Arc<Self>),
    /// From the first texture (where the third is 0) to the second (where it is 1), per channel.
    Mix(Arc<Self>, Arc<Self>, Arc<Self>),
}

impl Texture {
    /// Its linear colour at a point.
    ///
    /// A product of means is not the mean of products: of what two factors share in detail that the footprint is too large
    /// for, nothing is left.
    pub fn color(&self, at: &SurfacePoint, images: &dyn ImageLookup) -> [f32; 3] {
        let color = |texture: &Self| texture.color(at, images);
        match self {
            Self::Constant(constant) => *constant,
            Self::Image(image) => image.color(at, images),
            Self::Function(function) => function.color(at),
            Self::Scale(first, second) => product(color(first), color(second)),
            Self::Mix(from, to, amount) => mix(color(from), color(to), color(amount)),
        }
    }
}

impl Texture {
    /// Adds the images that it is made of to a list.
    pub(crate) fn collect_images<'a>(&'a self, images: &mut Vec<&'a ImageTexture>) {
        match self {
            Self::Constant(_) | Self::Function(_) => {}
            Self::Image(image) => images.push(image),
            Self::Scale(first, second) => [first, second].iter().for_each(|part| part.collect_images(images)),
            Self::Mix(from, to, amount) => {
                [from, to, amount].iter().for_each(|part| part.collect_images(images));
            }
        }
    }
}

fn product(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] * b[0], a[1] * b[1], a[2] * b[2]]
}

fn mix(from: [f32; 3], to: [f32; 3], amount: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|i| (1.0 - amount[i]) * from[i] + amount[i] * to[i])
}

//! What is benchmarked: a cloud, a number of samples and a blur, each combination with a name.

use crate::{sphere, sphere_camera, sphere_options};
use anyhow::Context;
use glam::DVec2;
use splat_core::fit::{Framing, Up, fit};
use splat_core::prepare::{PrepareOptions, prepare};
use splat_core::{Camera, Cloud, Lens, Projection, RenderOptions, Shading};
use std::fmt;
use std::path::PathBuf;

/// The environment variable that names the folder of real files.
const DATA: &str = "SPLAT_TEST_DATA";

/// Focal length of the sphere's camera, in pixels.
const FOCAL_LENGTH: f64 = 960.0;

/// What is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Subject {
    /// The sphere of this many thousand discs.
    Sphere(usize),
    /// The same at a quarter of its width and height, of a sixteenth as many discs: each is as large in pixels as in the
    /// whole one. For tools that are slow.
    Quarter(usize),
    /// The sphere, each disc in a colour of its own.
    Colored(usize),
    /// `surfels/dragon_res3_surfels.ply` of the real files.
    Dragon,
    /// `surfels/pond_pmvs.ply` of the real files.
    Pond,
}

/// How far out of focus it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Blur {
    /// Not at all.
    Pinhole,
    /// A circle of about 4 pixels' radius at the sphere's centre.
    Small,
    /// One of about 40 pixels' radius.
    Large,
}

/// A benchmark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Case {
    /// What is drawn.
    pub subject: Subject,
    /// Samples a pixel.
    pub samples: u32,
    /// Its blur.
    pub blur: Blur,
}

/// How a cloud is rendered.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The camera.
    pub camera: Camera,
    /// The options.
    pub options: RenderOptions,
}

impl Subject {
    /// All that stand in the benchmark table.
    pub const ALL: [Self; 4] = [Self::Sphere(100), Self::Sphere(1000), Self::Dragon, Self::Pond];

    /// Its cases: every number of samples with every blur for the sphere, the renderer's defaults for real clouds.
    pub fn cases(self) -> Vec<Case> {
        let case = |samples, blur| Case { subject: self, samples, blur };
        match self {
            Self::Dragon | Self::Pond => vec![case(16, Blur::Pinhole)],
            Self::Sphere(_) | Self::Quarter(_) | Self::Colored(_) => {
                [8, 16].into_iter().flat_map(|samples| Blur::ALL.map(|blur| case(samples, blur))).collect()
            }
        }
    }

    /// Its cloud, ready to be rendered. `None` if it is a real one and nobody said where those are.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn cloud(self) -> anyhow::Result<Option<Cloud>> {
        let file = match self {
            Self::Sphere(thousands) => return Ok(Some(sphere(thousands * 1000))),
            Self::Quarter(thousands) => return Ok(Some(sphere(thousands * 1000 / 16))),
            Self::Colored(thousands) => return Ok(Some(colored(sphere(thousands * 1000)))),
            Self::Dragon => "surfels/dragon_res3_surfels.ply",
            Self::Pond => "surfels/pond_pmvs.ply",
        };
        let Some(folder) = std::env::var_os(DATA).map(PathBuf::from) else { return Ok(None) };
        let mut cloud = splat_io::read_ply(&folder.join(file)).context("a real file")?.cloud;
        let RenderOptions { kernel, cutoff, .. } = RenderOptions::default();
        prepare(&mut cloud, &PrepareOptions { kernel, cutoff, ..PrepareOptions::default() }, &mut |_| {});
        Ok(Some(cloud))
    }

    /// Why there is no cloud, where there is none.
    pub fn skipped(self) -> String {
        format!("{self}: skipped, {DATA} does not name a folder with surfels/")
    }
}

/// A cloud coloured by where its splats stand.
fn colored(mut cloud: Cloud) -> Cloud {
    cloud.colors = Some(cloud.positions.iter().map(|position| 0.5 + 0.5 * *position).collect());
    cloud
}

impl fmt::Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sphere(thousands) => write!(f, "sphere-{thousands}k"),
            Self::Quarter(thousands) => write!(f, "quarter-{thousands}k"),
            Self::Colored(thousands) => write!(f, "colored-{thousands}k"),
            Self::Dragon => write!(f, "dragon"),
            Self::Pond => write!(f, "pond"),
        }
    }
}

impl Blur {
    /// The least first.
    pub const ALL: [Self; 3] = [Self::Pinhole, Self::Small, Self::Large];

    /// The lens that makes it in front of the sphere.
    fn lens(self, focal_length: f64) -> Option<Lens> {
        let radius = match self {
            Self::Pinhole => return None,
            Self::Small => 0.007,
            Self::Large => 0.07,
        };
        Some(Lens { radius: radius * FOCAL_LENGTH / focal_length, focus: 1.0, blades: 0 })
    }
}

impl fmt::Display for Blur {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Pinhole => "pinhole",
            Self::Small => "blur4",
            Self::Large => "blur40",
        })
    }
}

impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}-{}-{}", self.subject, self.samples, self.blur)
    }
}

impl Case {
    /// The case of this name.
    ///
    /// # Errors
    /// If there is none; the message lists them all.
    pub fn named(name: &str) -> anyhow::Result<Self> {
        let others = [100, 1000].into_iter().flat_map(|n| [Subject::Quarter(n), Subject::Colored(n)]);
        let cases: Vec<Self> =
            Subject::ALL.into_iter().chain(others).flat_map(|subject| subject.cases()).collect();
        let found = cases.iter().find(|case| case.to_string() == name).copied();
        let names: Vec<String> = cases.iter().map(Self::to_string).collect();
        found.with_context(|| format!("found case {name:?}, expected one of {}", names.join(" ")))
    }

    /// The same with nothing out of focus.
    pub fn pinhole(self) -> Self {
        Self { blur: Blur::Pinhole, ..self }
    }

    /// Camera and options for the subject's cloud.
    ///
    /// # Errors
    /// If the cloud has nothing to be seen.
    pub fn scene(self, cloud: &Cloud) -> anyhow::Result<Scene> {
        match self.subject {
            Subject::Sphere(_) | Subject::Colored(_) => Ok(self.sphere_scene(1)),
            Subject::Quarter(_) => Ok(self.sphere_scene(4)),
            Subject::Dragon | Subject::Pond => self.fitted_scene(cloud),
        }
    }

    fn sphere_scene(self, part: u32) -> Scene {
        let mut camera = sphere_camera();
        let focal_length = FOCAL_LENGTH / f64::from(part);
        camera.width /= part;
        camera.height /= part;
        camera.principal_point /= f64::from(part);
        camera.projection = Projection::Perspective {
            focal_length: DVec2::splat(focal_length),
            lens: self.blur.lens(focal_length),
        };
        Scene { camera, options: RenderOptions { samples: self.samples, ..sphere_options() } }
    }

    /// What `splat render --size 1920x1080` does without further options.
    fn fitted_scene(self, cloud: &Cloud) -> anyhow::Result<Scene> {
        let shading = if cloud.colors.is_some() { Shading::Color } else { Shading::Headlight };
        let options = RenderOptions { samples: self.samples, shading, ..RenderOptions::default() };
        let framing = Framing {
            width: 1920,
            height: 1080,
            up: Up::Y,
            azimuth: 30.0,
            elevation: 20.0,
            orthographic: false,
        };
        Ok(Scene { camera: fit(cloud, &framing, &options)?, options })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_case_is_found_by_its_name() {
        for case in Subject::ALL.into_iter().flat_map(Subject::cases) {
            assert_eq!(Case::named(&case.to_string()).unwrap(), case);
        }
        assert!(Case::named("nothing").is_err());
    }

    #[test]
    fn the_blur_is_as_wide_as_its_name_says() {
        // The radius of the circle of confusion at the sphere's centre.
        for (blur, pixels) in [(Blur::Small, 4.0), (Blur::Large, 40.0)] {
            let lens = blur.lens(240.0).unwrap();
            let radius = lens.radius * 240.0 * (1.0 - 1.0 / 2.17);
            assert!((0.8..1.1).contains(&(radius / pixels)), "{radius} pixels");
        }
    }
}

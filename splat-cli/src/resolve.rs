//! From raw options to the camera and the options of the renderer.
//!
//! What does not need the cloud is settled (and refused) before anything is read: [`options`]. The rest is
//! settled against the prepared cloud: [`against_cloud`].

use crate::arguments::{CameraArguments, RenderArguments, SampleArguments, SplatArguments};
use crate::choices::{CoverageChoice, ResolveChoice, ShadingChoice};
use crate::material;
use crate::usage::UsageError;
use crate::values::{ThicknessValue, ViewDirection};
use glam::DVec3;
use splat_abuffer::{Coverage, Resolve, Thickness};
use splat_core::fit::{Framing, NEAR, Up, direction};
use splat_core::{Camera, Cloud, Kernel, Lens, PixelRect, Projection, RenderOptions};

/// Size of the picture where neither an option nor a camera says anything, in pixels.
const DEFAULT_SIZE: [u32; 2] = [1280, 960];

/// The three-quarter view.
const DEFAULT_VIEW: ViewDirection = ViewDirection { azimuth: 30.0, elevation: 20.0 };

/// The light from above the viewer's right shoulder, for someone who looks at the front.
const DEFAULT_LIGHT: ViewDirection = ViewDirection { azimuth: 45.0, elevation: 45.0 };

/// The options of the renderer, save what depends on the cloud: shading and window; `trained` says whether it is one of
/// trained splats ([`Cloud::trained`]), on which the defaults depend, but not whether the options are right.
///
/// # Errors
/// Values out of range, and options that contradict each other.
pub fn options(arguments: &RenderArguments, trained: bool) -> Result<RenderOptions, UsageError> {
    let CameraArguments { camera, view, ortho, fstop, lens_radius, focus, blades, .. } = &arguments.camera;
    if view.is_some() && ortho.flatten().is_some() {
        return Err(UsageError::new("--ortho says from where already: leave out --view"));
    }
    let has_lens = fstop.is_some() || lens_radius.is_some();
    if camera.is_none() && !has_lens && (focus.is_some() || blades.is_some()) {
        return Err(UsageError::new(NEEDS_LENS));
    }
    let (samples, splats) = (&arguments.samples, &arguments.splats);
    if splats.light.is_some() && splats.shading != ShadingChoice::Lambert {
        return Err(UsageError::new("--light says nothing without --shading lambert"));
    }
    if splats.edl_strength.is_some() && splats.shading != ShadingChoice::Edl {
        return Err(UsageError::new("--edl-strength says nothing without --shading edl"));
    }
    if splats.shading == ShadingChoice::Edl {
        if samples.samples.is_some() {
            return Err(UsageError::new(
                "--shading edl needs all samples: it cannot be joined from --samples A:B",
            ));
        }
        if resolve_choice(splats, trained) == ResolveChoice::Over {
            return Err(UsageError::new("--shading edl is for surfaces: it does not go with --resolve over"));
        }
    }
    material::check(&arguments.material)?;
    let resolve = resolve_choice(splats, trained);
    let (kernel, cutoff) = match resolve {
        ResolveChoice::Surface => (Kernel::Windowed, 4.0),
        ResolveChoice::Over => (Kernel::Gaussian, 9.0),
    };
    let mut options = RenderOptions {
        samples: samples.spp,
        sample_range: samples.samples.clone(),
        filter: samples.filter.into(),
        pattern: samples.pattern.into(),
        seed: samples.seed,
        kernel: splats.kernel.map_or(kernel, Kernel::from),
        cutoff: splats.cutoff.unwrap_or(cutoff),
        table: splats.exp.into(),
        resolve: resolve_mode(resolve, splats)?,
        cull: splats.cull,
        background: splats.background.0,
        aovs: arguments.outputs.aov.unwrap_or_default(),
        ..RenderOptions::default()
    };
    if let Some(ThicknessValue::Factor(factor)) = splats.thickness {
        options.thickness = factor;
    }
    options.check().map_err(UsageError::new)?;
    Ok(options)
}

const NEEDS_LENS: &str = "--focus and --blades need a lens: add --fstop or --lens-radius";

/// Where `--resolve` leaves it open, trained splats are blended one by one, unless another option speaks of surfaces.
fn resolve_choice(splats: &SplatArguments, trained: bool) -> ResolveChoice {
    let SplatArguments { resolve, coverage, wsat, thickness, .. } = *splats;
    let of_surfaces = coverage.is_some() || wsat.is_some() || thickness.is_some();
    let default = if trained && !of_surfaces { ResolveChoice::Over } else { ResolveChoice::Surface };
    resolve.unwrap_or(default)
}

/// How fragments become a colour.
fn resolve_mode(resolve: ResolveChoice, splats: &SplatArguments) -> Result<Resolve, UsageError> {
    let SplatArguments { coverage, wsat, thickness, .. } = *splats;
    if resolve == ResolveChoice::Over {
        let given = [
            ("--coverage", coverage.is_some()),
            ("--wsat", wsat.is_some()),
            ("--thickness", thickness.is_some()),
        ];
        return match given.iter().find(|(_, is_given)| *is_given) {
            Some((name, _)) => Err(UsageError::new(format!("{name} says nothing with --resolve over"))),
            None => Ok(Resolve::Over),
        };
    }
    let coverage = match coverage.unwrap_or_default() {
        CoverageChoice::Soft => Coverage::Soft { saturation: wsat.unwrap_or(1.0) as f32 },
        CoverageChoice::Opaque if wsat.is_some() => {
            return Err(UsageError::new("--wsat says nothing without --coverage soft"));
        }
        CoverageChoice::Opaque => Coverage::Opaque,
    };
    let thickness = match thickness {
        Some(ThicknessValue::Listing) => Thickness::WholeSplat,
        _ => Thickness::AroundHit,
    };
    Ok(Resolve::Surface { coverage, thickness })
}

/// The up axis that is assumed: z for a cloud far from zero, which is a map; -y for trained splats, which have the axes of a
/// camera.
pub fn assumed_up(cloud: &Cloud) -> Up {
    match cloud.origin == DVec3::ZERO {
        false => Up::Z,
        true if cloud.trained => Up::MinusY,
        true => Up::Y,
    }
}

/// The default near depth for a camera file, in scene units.
pub fn default_near(cloud: &Cloud) -> f64 {
    (NEAR * cloud.diagonal()).max(f64::MIN_POSITIVE)
}

/// The camera, with the lens that is asked for, and the complete options, for a prepared cloud. `camera` is that of a
/// file or fitted.
///
/// # Errors
/// [`UsageError`] for values that do not go with this cloud or camera; the renderer's own error if the cloud
/// cannot be shown.
pub fn against_cloud(
    arguments: &RenderArguments,
    mut options: RenderOptions,
    mut camera: Camera,
    cloud: &Cloud,
) -> anyhow::Result<(Camera, RenderOptions)> {
    camera.near = arguments.camera.near.unwrap_or(camera.near);
    let centre = cloud.bounds().map_or(DVec3::ZERO, |(low, high)| 0.5 * (low + high));
    apply_lens(&arguments.camera, &mut camera, centre)?;
    camera.check().map_err(UsageError::new)?;
    options.window = window(&arguments.samples, camera.width, camera.height)?;
    let has_colors = cloud.colors.is_some() || arguments.material.texture.is_some();
    let light = arguments.splats.light.unwrap_or(DEFAULT_LIGHT);
    let to_light = direction(up(&arguments.camera, cloud), light.azimuth, light.elevation);
    options.shading = arguments.splats.shading.shading(has_colors, to_light);
    Ok((camera, options))
}

/// The axis that points up.
pub fn up(arguments: &CameraArguments, cloud: &Cloud) -> Up {
    arguments.up.map_or_else(|| assumed_up(cloud), Up::from)
}

/// From where a fitted camera looks.
pub fn framing(arguments: &CameraArguments, cloud: &Cloud) -> Framing {
    let [width, height] = arguments.size.unwrap_or(DEFAULT_SIZE);
    let view = arguments.ortho.flatten().or(arguments.view);
    let ViewDirection { azimuth, elevation } = view.unwrap_or(DEFAULT_VIEW);
    let up = up(arguments, cloud);
    Framing { width, height, up, azimuth, elevation, orthographic: arguments.ortho.is_some() }
}

/// Gives the camera the lens that the options ask for. What they leave open the camera's own lens decides;
/// the focus is else on `centre`, a world position. A lens that is only refocused keeps its radius.
fn apply_lens(arguments: &CameraArguments, camera: &mut Camera, centre: DVec3) -> Result<(), UsageError> {
    let CameraArguments { fstop, lens_radius, focus, blades, .. } = *arguments;
    if fstop.is_none() && lens_radius.is_none() && focus.is_none() && blades.is_none() {
        return Ok(());
    }
    let (world_to_camera, scale) = (camera.world_to_camera, camera.scale());
    let Projection::Perspective { lens, .. } = &mut camera.projection else {
        return Err(UsageError::new(
            "an orthographic camera has no lens: --fstop, --lens-radius, --focus, --blades",
        ));
    };
    let focus = match (focus, &lens) {
        (Some(focus), _) => focus,
        (None, Some(lens)) => lens.focus,
        (None, None) => world_to_camera.transform_point3(centre).z,
    };
    if focus.is_nan() || focus <= 0.0 {
        return Err(UsageError::new(
            "the cloud's centre is not in front of the camera: the lens needs --focus",
        ));
    }
    let blades = blades.or(lens.map(|lens| lens.blades)).unwrap_or(0);
    *lens = Some(match (lens_radius, fstop, &lens) {
        (Some(radius), _, _) => Lens { radius: radius * scale, focus, blades },
        (None, Some(fstop), _) => Lens::from_fstop(fstop, focus, blades),
        (None, None, Some(lens)) => Lens { radius: lens.radius, focus, blades },
        (None, None, None) => return Err(UsageError::new(NEEDS_LENS)),
    });
    Ok(())
}

/// The pixels that `--crop` or `--tile` ask for; `None` for all.
fn window(arguments: &SampleArguments, width: u32, height: u32) -> Result<Option<PixelRect>, UsageError> {
    let window = match (arguments.crop, arguments.tile) {
        (Some(crop), _) => crop,
        (None, Some(tile)) => tile.of_frame(width, height),
        (None, None) => return Ok(None),
    };
    if window.x1 > width as i32 || window.y1 > height as i32 {
        return Err(UsageError::new(format!("--crop reaches beyond the frame of {width}x{height} pixels")));
    }
    if window.is_empty() {
        return Err(UsageError::new(format!("--tile is empty: the frame has only {width}x{height} pixels")));
    }
    Ok(Some(window))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arguments::{Arguments, Command};
    use crate::cameras::Fitted;
    use clap::Parser;
    use glam::DMat4;
    use splat_core::Shading;

    fn arguments(line: &str) -> RenderArguments {
        let line = ["splat", "render", "in.ply", "-o", "out.exr"].into_iter().chain(line.split_whitespace());
        match Arguments::parse_from(line).command {
            Command::Render(arguments) => *arguments,
            other => panic!("{other:?}"),
        }
    }

    /// Nine splats in the plane z = 0, their centre at `centre`.
    fn cloud(centre: DVec3) -> Cloud {
        let points: Vec<DVec3> =
            (0..9).map(|i| centre + DVec3::new(f64::from(i % 3 - 1), f64::from(i / 3 - 1), 0.0)).collect();
        let mut cloud = Cloud::from_points(&points);
        splat_core::prepare::prepare(
            &mut cloud,
            &splat_core::prepare::PrepareOptions::default(),
            &mut |_| {},
        );
        cloud
    }

    fn resolved(line: &str, cloud: &Cloud) -> anyhow::Result<(Camera, RenderOptions)> {
        let arguments = arguments(line);
        let options = options(&arguments, cloud.trained)?;
        let camera = Fitted::new(&arguments, cloud, &options)?.camera(0);
        against_cloud(&arguments, options, camera, cloud)
    }

    #[test]
    fn no_options_are_the_defaults_of_the_renderer() {
        assert_eq!(options(&arguments(""), false).unwrap(), RenderOptions::default());
    }

    #[test]
    fn defaults_depend_on_the_resolve_and_explicit_options_win() {
        let over = options(&arguments("--resolve over"), false).unwrap();
        assert_eq!((over.kernel, over.cutoff, over.resolve), (Kernel::Gaussian, 9.0, Resolve::Over));
        let mixed = options(&arguments("--resolve over --kernel disc --cutoff 1"), false).unwrap();
        assert_eq!((mixed.kernel, mixed.cutoff), (Kernel::Disc, 1.0));
        assert_eq!(options(&arguments(""), true).unwrap(), over);
        assert_eq!(options(&arguments("--resolve surface"), true).unwrap(), RenderOptions::default());
    }

    #[test]
    fn surfaces_can_be_soft_and_as_in_the_listing() {
        let soft = options(&arguments("--coverage soft --wsat 0.75 --thickness listing"), true).unwrap();
        let expected = Resolve::Surface {
            coverage: Coverage::Soft { saturation: 0.75 },
            thickness: Thickness::WholeSplat,
        };
        assert_eq!(soft.resolve, expected);
        assert_eq!(options(&arguments("--thickness 0.25"), true).unwrap().thickness, 0.25);
    }

    #[test]
    fn contradictions_are_refused_before_anything_is_read() {
        let contradictions = [
            "--focus 3",
            "--blades 6",
            "--wsat 1",
            "--coverage opaque --wsat 1",
            "--resolve over --thickness 1",
            "--resolve over --coverage soft",
            "--ortho top --view front",
            "--spp 0",
            "--spp 8 --samples 4:9",
            "--spp 2000 --pattern poisson",
        ];
        for line in contradictions {
            assert!(options(&arguments(line), false).is_err(), "{line}");
            assert!(options(&arguments(line), true).is_err(), "{line}");
        }
    }

    #[test]
    fn maps_have_z_up_and_trained_splats_y_down() {
        assert_eq!(assumed_up(&cloud(DVec3::ZERO)), Up::Y);
        assert_eq!(assumed_up(&Cloud { trained: true, ..cloud(DVec3::ZERO) }), Up::MinusY);
        assert_eq!(assumed_up(&cloud(DVec3::new(5e5, 5e6, 100.0))), Up::Z);
    }

    #[test]
    fn the_camera_is_fitted_and_the_lens_focused_on_the_centre() {
        let cloud = cloud(DVec3::new(0.0, 0.0, -7.0));
        let (camera, options) =
            resolved("--view front --size 64x48 --lens-radius 0.25 --blades 5", &cloud).unwrap();
        assert_eq!((camera.width, camera.height), (64, 48));
        assert_eq!(options.shading, Shading::Headlight);
        let lens = camera.lens().unwrap();
        assert_eq!((lens.radius, lens.blades), (0.25, 5));
        assert!((lens.focus - (camera.eye().z + 7.0)).abs() < 1e-9, "{lens:?} {}", camera.eye());
        let (camera, _) = resolved("--fstop 2 --focus inf --near 0.5", &cloud).unwrap();
        assert_eq!(camera.lens(), Some(Lens { radius: 0.25, focus: f64::INFINITY, blades: 0 }));
        assert_eq!(camera.near, 0.5);
    }

    #[test]
    fn options_override_the_lens_of_a_camera_file() {
        let cloud = cloud(DVec3::new(0.0, 0.0, 5.0));
        let own = Lens { radius: 0.5, focus: 3.0, blades: 7 };
        let camera = |lens| Camera {
            width: 8,
            height: 8,
            projection: Projection::Perspective { focal_length: glam::DVec2::splat(8.0), lens },
            principal_point: glam::DVec2::splat(4.0),
            world_to_camera: DMat4::IDENTITY,
            near: 0.1,
            far: f64::INFINITY,
            clip_planes: Vec::new(),
            distortion: None,
        };
        let lens_of = |line: &str, lens| {
            let arguments = arguments(&format!("--camera c.json {line}"));
            let options = options(&arguments, false).unwrap();
            against_cloud(&arguments, options, camera(lens), &cloud).map(|(camera, _)| camera.lens())
        };
        assert_eq!(lens_of("", Some(own)).unwrap(), Some(own));
        assert_eq!(lens_of("--focus 4", Some(own)).unwrap(), Some(Lens { focus: 4.0, ..own }));
        assert_eq!(lens_of("--lens-radius 1", Some(own)).unwrap(), Some(Lens { radius: 1.0, ..own }));
        assert_eq!(
            lens_of("--lens-radius 1", None).unwrap(),
            Some(Lens { radius: 1.0, focus: 5.0, blades: 0 })
        );
        assert!(lens_of("--blades 5", None).unwrap_err().is::<UsageError>());
        assert!(lens_of("--near 1e9 --focus 4", Some(own)).is_ok());
    }

    #[test]
    fn windows_lie_within_the_frame() {
        let cloud = cloud(DVec3::ZERO);
        let window = |line: &str| {
            resolved(&format!("--size 100x90 {line}"), &cloud).map(|(_, options)| options.window)
        };
        assert_eq!(window("").unwrap(), None);
        assert_eq!(window("--crop 0,0,100,90").unwrap(), Some(PixelRect::new(0, 0, 100, 90)));
        assert_eq!(window("--tile 5/4x3").unwrap(), Some(PixelRect::new(25, 30, 50, 60)));
        for line in ["--crop 0,0,101,90", "--crop 100,0,120,9", "--tile 0/200x1"] {
            assert!(window(line).unwrap_err().is::<UsageError>(), "{line}");
        }
    }
}

//! Options and assumptions in words.

use crate::colors::default_choice;
use crate::resolve::assumed_up;
use crate::values::ColorChoice;
use splat_abuffer::{Coverage, Resolve, Thickness};
use splat_core::fit::Up;
use splat_core::prepare::unknown_sizes;
use splat_core::{Cloud, Kernel, PatternKind, PixelFilter, RenderOptions, Shading, TableMode};
use splat_io::ImportReport;

/// The options that tell one picture from another, as the command line has them; samples, seed and window have
/// attributes of their own.
pub fn options(options: &RenderOptions) -> String {
    let filter = match options.filter {
        PixelFilter::Box => "box",
        PixelFilter::Tent => "tent",
        PixelFilter::Gaussian => "gaussian",
        PixelFilter::BlackmanHarris => "blackman-harris",
    };
    let pattern = match options.pattern {
        PatternKind::PoissonDisc => "poisson",
        PatternKind::Sobol => "sobol",
        PatternKind::Dealt => "dealt",
    };
    let kernel = match options.kernel {
        Kernel::Gaussian => "gaussian",
        Kernel::Windowed => "windowed",
        Kernel::Disc => "disc",
    };
    let table = match options.table {
        TableMode::Floor256 => "floor256",
        TableMode::Midpoint256 => "midpoint256",
        TableMode::Lerp256 => "lerp256",
        TableMode::Quartic8 => "quartic8",
        TableMode::Poly8 => "poly8",
    };
    let resolve = match options.resolve {
        Resolve::Over => "over".to_owned(),
        Resolve::Surface { coverage, thickness } => {
            let coverage = match coverage {
                Coverage::Opaque => "opaque".to_owned(),
                Coverage::Soft { saturation } => format!("soft --wsat {saturation}"),
            };
            let thickness = match thickness {
                Thickness::AroundHit => options.thickness.to_string(),
                Thickness::WholeSplat => "listing".to_owned(),
            };
            format!("surface --coverage {coverage} --thickness {thickness}")
        }
    };
    let shading = match options.shading {
        Shading::Color => "color",
        Shading::Headlight => "headlight",
        // Where the light is depends on what is up: whoever knows adds it.
        Shading::Lambert { .. } => "lambert",
    };
    let background = match options.background {
        None => "none".to_owned(),
        Some(color) => color.map(|value| value.to_string()).join(","),
    };
    let cutoff = options.cutoff;
    let mut text = format!(
        "--filter {filter} --pattern {pattern} --kernel {kernel} --cutoff {cutoff} --exp {table} \
         --resolve {resolve} --shading {shading} --background {background}"
    );
    if options.cull {
        text.push_str(" --cull");
    }
    text
}

/// What `splat render` assumes of a cloud, as it was read, where no option says otherwise.
pub fn assumptions(cloud: &Cloud) -> Vec<String> {
    let mut assumptions = vec![match assumed_up(cloud) {
        Up::Z => "z is up, since the points lie far from zero as in maps (--up)".to_owned(),
        Up::MinusY => {
            "y is down, as in the axes of the cameras that splats are trained with (--up)".to_owned()
        }
        _ => "y is up (--up)".to_owned(),
    }];
    if cloud.is_empty() {
        return assumptions;
    }
    if cloud.normals.is_empty() {
        assumptions.push(
            "normals are estimated from neighbours; both sides of a splat look alike (--orient, --viewpoint)"
                .to_owned(),
        );
    }
    if let unknown @ 1.. = unknown_sizes(cloud) {
        assumptions.push(format!("{unknown} sizes are estimated from the spacing of the points"));
    }
    if cloud.trained {
        assumptions
            .push("trained splats are blended one by one, as they are coloured (--resolve)".to_owned());
        let strays = "a fitted camera leaves out strays: splats far outside of the bulk of the others";
        assumptions.push(strays.to_owned());
    } else if cloud.areas.is_none() {
        assumptions.push("areas are estimated from neighbours".to_owned());
    }
    assumptions.extend(match default_choice(cloud) {
        Some(ColorChoice::Rgb) => None,
        Some(_) => Some("there is no colour: the intensity is shown (--color)".to_owned()),
        None => Some(
            "there is no colour: a headlight shades the surfaces (--shading; edl shows more of terrain and trees)"
                .to_owned(),
        ),
    });
    assumptions
}

/// The files that were read: "a.ply, b.ply".
pub fn paths(reports: &[ImportReport]) -> String {
    let paths: Vec<String> = reports.iter().map(|report| report.path.display().to_string()).collect();
    paths.join(", ")
}

/// Causes and their counts: "3 not_finite, 1 zero_normal".
pub fn causes<'a>(causes: impl IntoIterator<Item = (&'a &'static str, &'a usize)>) -> String {
    let causes: Vec<String> = causes.into_iter().map(|(cause, count)| format!("{count} {cause}")).collect();
    causes.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arguments::{Arguments, Command};
    use crate::resolve;
    use clap::Parser;

    #[test]
    fn options_in_words_give_the_same_options_again() {
        let lines = [
            "",
            "--resolve over --background 0,0.5,1,1 --cull",
            "--coverage soft --wsat 0.5 --thickness listing --exp floor256 --pattern poisson --filter tent",
        ];
        for line in lines {
            let parse = |line: &str| {
                let line = format!("splat render in.ply -o out.exr {line}");
                match Arguments::parse_from(line.split_whitespace()).command {
                    Command::Render(arguments) => resolve::options(&arguments, false).unwrap(),
                    other => panic!("{other:?}"),
                }
            };
            let once = parse(line);
            assert_eq!(parse(&options(&once)), once, "{line}");
        }
    }

    #[test]
    fn bare_points_need_many_assumptions() {
        let cloud = Cloud::from_points(&[glam::DVec3::ONE; 3]);
        assert_eq!(assumptions(&cloud).len(), 5);
        assert_eq!(unknown_sizes(&cloud), 3);
        assert_eq!(assumptions(&Cloud::default()).len(), 1);
    }
}

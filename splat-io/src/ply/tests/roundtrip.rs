//! What is written reads back as the same cloud.

use super::*;
use glam::{DVec3, Vec2, Vec3};
use proptest::prelude::*;
use splat_core::{Field, Shapes, TextureCoordinates};

/// Everything in a cloud, as bits.
fn bits(cloud: &Cloud) -> (Vec<u64>, Vec<Option<Vec<u32>>>, bool) {
    let vectors = |vectors: &[Vec3]| vectors.iter().flat_map(|v| v.to_array()).map(f32::to_bits).collect();
    let scalars = |scalars: &Vec<f32>| scalars.iter().map(|s| s.to_bits()).collect();
    let shapes = match &cloud.shapes {
        Shapes::Discs(sizes) => scalars(sizes),
        Shapes::Ellipses(axes) => vectors(axes.as_flattened()),
    };
    let mut columns = vec![
        Some(vectors(&cloud.positions)),
        Some(vectors(&cloud.normals)),
        Some(shapes),
        cloud.colors.as_deref().map(vectors),
        cloud.opacities.as_ref().map(scalars),
        cloud.areas.as_ref().map(scalars),
        cloud
            .texture_coordinates
            .as_ref()
            .map(|all| scalars(&all.iter().flat_map(|c| c.to_array()).collect())),
    ];
    columns.extend(cloud.fields.iter().map(|field| Some(scalars(&field.values))));
    (cloud.origin.to_array().map(f64::to_bits).to_vec(), columns, cloud.oriented)
}

fn assert_round_trip(cloud: &Cloud) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cloud.ply");
    for encoding in [PlyEncoding::Binary, PlyEncoding::Ascii] {
        write_ply(&path, cloud, encoding).unwrap();
        let read = read_ply(&path).unwrap().cloud;
        assert_eq!(bits(&read), bits(cloud), "{encoding:?}");
    }
}

prop_compose! {
    fn unit_vector()(v in prop::array::uniform3(-1.0..1.0_f64)) -> Vec3 {
        DVec3::from_array(v).try_normalize().unwrap_or(DVec3::Z).as_vec3()
    }
}

prop_compose! {
    fn any_cloud()(
        origin in prop_oneof![Just(DVec3::ZERO), Just(DVec3::new(500_000.1, 5e6 + 0.3, 100.0))],
        rows in prop::collection::vec(
            (
                prop::array::uniform3(-1e3..1e3_f64),
                unit_vector(),
                prop::array::uniform6(any::<f32>().prop_filter("finite", |v| v.is_finite())),
                prop::array::uniform3(0.0..1e4_f32),
                0.0..=1.0_f32,
                1e-30..1e30_f32,
                prop::array::uniform6(any::<f32>().prop_filter("finite", |v| v.is_finite())),
            ),
            1..20,
        ),
        has in prop::array::uniform6(any::<bool>()),
        oriented in any::<bool>(),
    ) -> Cloud {
        // Some positions are f32 numbers, far from any origin.
        let offsets = rows.iter().map(|row| DVec3::from_array(row.0).as_vec3().as_dvec3());
        let points: Vec<_> = offsets.map(|offset| origin + offset).collect();
        let mut cloud = Cloud::from_points(&points);
        if has[0] {
            cloud.normals = rows.iter().map(|row| row.1).collect();
            cloud.oriented = oriented;
        }
        let vector = |v: &[f32]| Vec3::from_slice(v);
        cloud.shapes = if has[1] {
            Shapes::Ellipses(rows.iter().map(|row| [vector(&row.2[..3]), vector(&row.2[3..])]).collect())
        } else {
            Shapes::Discs(rows.iter().map(|row| row.2[0]).collect())
        };
        cloud.colors = has[2].then(|| rows.iter().map(|row| Vec3::from_array(row.3)).collect());
        cloud.opacities = has[3].then(|| rows.iter().map(|row| row.4).collect());
        cloud.areas = has[4].then(|| rows.iter().map(|row| row.5).collect());
        let pair = |v: &[f32; 6], first: usize| Vec2::new(v[first], v[first + 1]);
        let coordinates = |v: &[f32; 6]| TextureCoordinates {
            center: pair(v, 0),
            per_u: pair(v, 2),
            per_v: pair(v, 4),
        };
        cloud.texture_coordinates = has[5].then(|| rows.iter().map(|row| coordinates(&row.6)).collect());
        cloud.fields = fields_of(&rows.iter().map(|row| row.2).collect::<Vec<_>>(), oriented);
        cloud
    }
}

/// Two scalar fields, if they are wanted.
fn fields_of(rows: &[[f32; 6]], wanted: bool) -> Vec<Field> {
    let field = |name: &str, column: usize| Field {
        name: name.to_owned(),
        values: rows.iter().map(|row| row[column]).collect(),
    };
    if wanted { vec![field("intensity", 4), field("return_number", 5)] } else { Vec::new() }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn every_cloud_round_trips_bit_for_bit(cloud in any_cloud()) {
        assert_round_trip(&cloud);
    }
}

#[test]
fn an_origin_that_the_reader_would_not_choose_round_trips() {
    let mut cloud = Cloud::from_points(&[DVec3::new(1.0, 2.0, 3.0)]);
    cloud.origin = DVec3::ZERO;
    cloud.positions = vec![Vec3::new(1.5, 2.5, 1e6)];
    assert_round_trip(&cloud);
}

#[test]
fn empty_and_bad_points_round_trip() {
    assert_round_trip(&Cloud::default());
    let mut cloud = Cloud::from_points(&[DVec3::ONE, DVec3::splat(f64::INFINITY), DVec3::NEG_ONE]);
    cloud.shapes = Shapes::Discs(vec![-1.0, f32::NEG_INFINITY, 0.0]);
    cloud.normals = vec![Vec3::ZERO, Vec3::X, Vec3::NEG_Z];
    assert_round_trip(&cloud);

    cloud.positions[0] = Vec3::NAN;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cloud.ply");
    for encoding in [PlyEncoding::Binary, PlyEncoding::Ascii] {
        write_ply(&path, &cloud, encoding).unwrap();
        assert!(read_ply(&path).unwrap().cloud.positions[0].is_nan());
    }
}

#[test]
fn a_cloud_that_does_not_fit_together_is_not_written() {
    let cloud = Cloud { areas: Some(vec![1.0]), ..Cloud::default() };
    let message =
        write_ply(Path::new("never-written.ply"), &cloud, PlyEncoding::Ascii).unwrap_err().to_string();
    assert_eq!(message, "never-written.ply: cloud: areas has 1 entries for 0 positions");
    assert!(!Path::new("never-written.ply").exists());
}

//! Every operation of [`Lanes`] at every level that the machine has, against the same of scalar `f32`.

use super::{Eight, Kernel, LANES, Lanes, Level};

/// Values of two cells.
type Sixteen = [Eight; 2];

/// Numbers at which comparing, rounding and dividing go wrong.
const HARD: [f32; 40] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    -0.5,
    f32::NAN,
    -f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MAX,
    f32::MIN,
    f32::MIN_POSITIVE,
    -f32::MIN_POSITIVE,
    f32::EPSILON,
    // Denormal: the least, the greatest, and one between.
    f32::from_bits(1),
    -f32::from_bits(1),
    f32::from_bits(0x7f_ffff),
    -f32::from_bits(0x7f_ffff),
    f32::from_bits(0x1234),
    // Next to integers, and about to lose their fractions.
    0.999_999_94,
    -0.999_999_94,
    1.000_000_1,
    -1.000_000_1,
    7.999_999_5,
    2.5,
    -2.5,
    3.0,
    -3.0,
    8_388_607.5,
    -8_388_607.5,
    8_388_608.0,
    16_777_216.0,
    -16_777_217.0,
    2_147_483_520.0,
    -2_147_483_520.0,
    // Products and quotients of these are at the ends of the range.
    1e38,
    1e-38,
    3e-20,
    0.1,
];

/// All pairs of hard numbers, and of some of any bits; sixteen at a time, each number in every lane.
fn cases() -> Vec<[Sixteen; 2]> {
    let mut bits = 1u32;
    let mut any = || {
        bits = bits.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f32::from_bits(bits)
    };
    let numbers: Vec<f32> = HARD.into_iter().chain((0..60).map(|_| any())).collect();
    let count = numbers.len();
    let of = |start: usize| {
        [0, LANES].map(|cell| std::array::from_fn(|lane| numbers[(start + cell + lane) % count]))
    };
    (0..count).flat_map(|a| (0..count).step_by(7).map(move |b| [a, b])).map(|pair| pair.map(of)).collect()
}

/// The lanes of a vector, one after the other.
#[inline(always)]
fn lanes<L: Lanes>(vector: L) -> Vec<f32> {
    let mut cells = [[0.0; LANES]; 2];
    vector.store_cell::<0>(&mut cells[0]);
    if L::CELLS == 2 {
        vector.store_cell::<1>(&mut cells[1]);
    }
    cells[..L::CELLS].concat()
}

/// Checks the lanes of a vector by their bits; which not-a-number it is does not matter.
fn check(what: &str, found: &[f32], expected: impl Fn(usize) -> f32) {
    for (lane, &found) in found.iter().enumerate() {
        let expected = expected(lane);
        let same = found.to_bits() == expected.to_bits() || (found.is_nan() && expected.is_nan());
        assert!(same, "{what}, lane {lane}: {found:?} instead of {expected:?}");
    }
}

/// Checks that the lanes of a mask are all ones where they should be, else all zeros.
fn check_mask<L: Lanes>(what: &str, mask: L, expected: impl Fn(usize) -> bool) {
    let (found, bits) = (lanes(mask), mask.bits());
    for (lane, found) in found.iter().enumerate() {
        let expected = expected(lane);
        assert_eq!(found.to_bits(), if expected { u32::MAX } else { 0 }, "{what}, lane {lane}");
        assert_eq!(bits >> lane & 1 == 1, expected, "bits of {what}, lane {lane}");
    }
    assert_eq!(bits >> found.len(), 0, "{what}");
}

/// Runs a kernel at every level, both ways. Gives the number of levels.
fn at_every_level<K: Kernel<Output = usize>>(kernel: impl Fn() -> K) -> usize {
    for level in Level::available() {
        let cells = level.run(kernel());
        assert_eq!(cells, if level == Level::Avx512 { 2 } else { 1 }, "{}", level.name());
        assert_eq!(level.run_single(kernel()), 1);
    }
    Level::available().len()
}

/// Checks everything about two vectors; gives the number of cells of a vector.
struct CheckPair([Sixteen; 2]);

impl Kernel for CheckPair {
    type Output = usize;

    #[inline(always)]
    fn run<L: Lanes>(self) -> usize {
        let [[a0, a1], [b0, b1]] = self.0;
        let (a, b) = (L::load_cells(&a0, &a1), L::load_cells(&b0, &b1));
        let (x, y) = ([a0, a1].concat(), [b0, b1].concat());
        let count = L::CELLS * LANES;
        assert_eq!(lanes(a).len(), count);

        check("load", &lanes(a), |i| x[i]);
        check("load of one cell", &lanes(L::load(&a0)), |i| x[i % LANES]);
        assert_eq!(L::Single::CELLS, 1);
        check("splat", &lanes(L::splat(x[3])), |_| x[3]);
        check("splat of cells", &lanes(L::splat_cells(x[3], y[2])), |i| if i < LANES { x[3] } else { y[2] });

        check("+", &lanes(a + b), |i| x[i] + y[i]);
        check("-", &lanes(a - b), |i| x[i] - y[i]);
        check("*", &lanes(a * b), |i| x[i] * y[i]);
        check("/", &lanes(a / b), |i| x[i] / y[i]);
        check("square root", &lanes(a.square_root()), |i| x[i].sqrt());
        // Of two equal zeros it is always the other one.
        check("least", &lanes(a.least(b)), |i| if x[i] < y[i] { x[i] } else { y[i] });
        check("greatest", &lanes(a.greatest(b)), |i| if x[i] > y[i] { x[i] } else { y[i] });

        let less = a.less(b);
        check_mask("<", less, |i| x[i] < y[i]);
        check_mask("<=", a.less_or_equal(b), |i| x[i] <= y[i]);
        #[expect(clippy::neg_cmp_op_on_partial_ord, reason = "not the same where one is not a number")]
        {
            check_mask("not <", a.not_less(b), |i| !(x[i] < y[i]));
            check_mask("not <=", a.not_less_or_equal(b), |i| !(x[i] <= y[i]));
        }
        let other = b.less_or_equal(L::splat(0.0));
        check_mask("&", less & other, |i| x[i] < y[i] && y[i] <= 0.0);
        check_mask("|", less | other, |i| x[i] < y[i] || y[i] <= 0.0);
        check_mask("and not", less.and_not(other), |i| x[i] < y[i] && (y[i] > 0.0 || y[i].is_nan()));
        check_mask("or not", less.or_not(other), |i| x[i] < y[i] || y[i] > 0.0 || y[i].is_nan());

        // Masks and numbers.
        check("number & mask", &lanes(a & less), |i| if x[i] < y[i] { x[i] } else { 0.0 });
        check("select", &lanes(less.select(a, b)), |i| if x[i] < y[i] { x[i] } else { y[i] });
        check("number and not", &lanes(a.and_not(less)), |i| if x[i] < y[i] { 0.0 } else { x[i] });
        check("number or not", &lanes(a.or_not(less)), |i| if x[i] < y[i] { x[i] } else { f32::NAN });
        check("number | mask", &lanes(a | less), |i| if x[i] < y[i] { f32::NAN } else { x[i] });

        // Below 2^31, where 0 may have either sign.
        let floor = lanes(a.round_down());
        for (i, &found) in floor.iter().enumerate().filter(|(i, _)| x[*i].abs() < 2_147_483_648.0) {
            assert_eq!(found, x[i].floor(), "{} rounded down", x[i]);
        }

        let pair = |i: usize| [x[i], x[i + 1]];
        let pairs = [pair(3), pair(0), pair(5), pair(2)];
        let found = lanes(L::load_pairs([&pairs[0], &pairs[1], &pairs[2], &pairs[3]]));
        check("load of pairs", &found, |i| pairs[i % LANES / 2][i % 2]);
        let halves = [[x[1], x[2], x[3], x[4]], [y[3], y[2], y[1], y[0]]];
        let found = lanes(L::load_halves([&halves[0], &halves[1]]));
        check("load of halves", &found, |i| halves[i % LANES / 4][i % 4]);
        let set = (x[0].to_bits() ^ y[0].to_bits() >> 9) as u8;
        let packed = lanes(a.pack(set));
        let kept: Vec<f32> = (0..LANES).filter(|lane| set >> lane & 1 == 1).map(|lane| x[lane]).collect();
        for cell in packed.chunks(LANES) {
            check("pack", &cell[..kept.len()], |i| kept[i]);
        }
        let sums = L::sums([a, b, L::splat(0.25), b]);
        let sum = |x: &[f32]| ((x[0] + x[1]) + (x[2] + x[3])) + ((x[4] + x[5]) + (x[6] + x[7]));
        check("sums", &sums, |i| [sum(&x), sum(&y), 2.0, sum(&y)][i]);
        for (i, whole) in a.whole().into_iter().enumerate().filter(|(i, _)| x[*i].abs() < 2_147_483_648.0) {
            assert_eq!(whole, x[i] as i32, "whole part of {}", x[i]);
        }
        L::CELLS
    }
}

#[test]
fn every_operation_is_that_of_each_lane() {
    let cases = cases();
    assert!(cases.len() > 1000);
    for &case in &cases {
        assert!(at_every_level(|| CheckPair(case)) >= 1);
    }
}

/// Checks that a mask has the bits that it is made of.
struct CheckBits(u32);

impl Kernel for CheckBits {
    type Output = usize;

    #[inline(always)]
    fn run<L: Lanes>(self) -> usize {
        check_mask("a mask of bits", L::mask(self.0), |lane| self.0 >> lane & 1 == 1);
        L::CELLS
    }
}

#[test]
fn masks_have_their_bits() {
    for bits in (0..1 << 16).step_by(37).chain([0xff, 0xff00, 0xffff]) {
        at_every_level(|| CheckBits(bits));
    }
}

/// Checks what is read of a table, and that what is out of range is harmless.
struct CheckTable {
    table: Eight,
    x: Sixteen,
}

impl Kernel for CheckTable {
    type Output = usize;

    #[inline(always)]
    fn run<L: Lanes>(self) -> usize {
        let Self { table, x: [first, second] } = self;
        let found = lanes(L::look_up(&table, L::load_cells(&first, &second).to_index()));
        for (found, x) in found.into_iter().zip([first, second].concat()) {
            if (0.0..8.0).contains(&x) {
                assert_eq!(found.to_bits(), table[x as usize].to_bits(), "entry {x}");
            } else {
                assert!(table.iter().any(|entry| entry.to_bits() == found.to_bits()), "entry {x}");
            }
        }
        L::CELLS
    }
}

#[test]
fn tables_are_read_by_the_whole_part() {
    let table = [3.0, -1.0, f32::INFINITY, -0.0, 1e-41, 5.0, 7.25, f32::MAX];
    let below = |x: f32| f32::from_bits(x.to_bits() - 1);
    let wholes: Vec<f32> = (0..8).map(|i| i as f32).collect();
    let within = wholes.iter().flat_map(|&x| [x, x + 0.5, below(x + 1.0)]);
    let numbers: Vec<f32> = within.chain(HARD).collect();
    for start in 0..numbers.len() {
        let of = |cell| std::array::from_fn(|lane| numbers[(start + cell + lane) % numbers.len()]);
        at_every_level(|| CheckTable { table, x: [of(0), of(LANES)] });
    }
}

/// The sources of the workspace, but for what was built.
fn sources(folder: &std::path::Path, found: &mut Vec<std::path::PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder of the workspace") {
        let path = entry.expect("an entry").path();
        if path.is_dir() && path.file_name().is_none_or(|name| name != "target") {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn unsafe_code_is_in_two_files() {
    let workspace = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace");
    let crates = [
        "splat-abuffer",
        "splat-core",
        "splat-simd",
        "splat-io",
        "splat-cli",
        "splat-bench",
        "tests",
        "fuzz",
    ];
    let mut with_blocks = Vec::new();
    for name in crates {
        let mut files = Vec::new();
        sources(&workspace.join(name), &mut files);
        let read = |path: &std::path::Path| std::fs::read_to_string(path).unwrap_or_default();
        // Apart, so that this very file has none.
        let words = [["unsafe", "{"], ["unsafe", "fn"], ["unsafe", "impl"], ["unsafe", "extern"]]
            .map(|words| words.join(" "));
        with_blocks
            .extend(files.iter().filter(|file| words.iter().any(|word| read(file).contains(word))).cloned());
        let roots = ["src/lib.rs", "src/main.rs"].map(|root| workspace.join(name).join(root));
        for root in roots.iter().filter(|root| root.is_file() && name != "splat-simd") {
            assert!(read(root).contains("#![forbid(unsafe_code)]"), "{}", root.display());
        }
    }
    with_blocks.sort();
    let allowed = ["avx2.rs", "avx512.rs"].map(|file| workspace.join("splat-simd/src/lanes").join(file));
    assert_eq!(with_blocks, allowed);
}

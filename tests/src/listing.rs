//! The printed listing, literally: Räsänen 2002, appendix A.2, "Splatting pipeline using stochastic
//! sampling", errata and all.
//!
//! `L51` is the listing's line 51. The order of the arithmetic is the listing's; the scalar is a parameter
//! because some faults (E17, E28 of the notes) exist in f32 only. Row vectors throughout: `v *= M` is v M,
//! and `M[i][j]` is row i, column j.
//!
//! What had to be changed so that it compiles and cannot crash, and nothing else:
//! - L84 uses `cp` after its scope ended (E24): declared outside the loop. L75's `c`, which shadows the eye
//!   `c` of L41, is called `c_plane`.
//! - L150 and L156 use undeclared `width` and `height` (E27): fields of [`Parameters`].
//! - L196 can index one past the table (E17): [`ListingFragment::weight`] is `None` then.
//! - L162, "call the splat shader here": the splat's own colour, untouched.
//! - L149 and L155 convert to `int`; a NaN or an overflow, undefined in C++, saturates here (NaN to 0).
//!
//! Everything up to the loop over pixels is computed for every splat, culled or not: it has no side effects,
//! and tests want to see what a culled splat would have got. [`SetUp::culled`] says where the listing would
//! have left the loop body.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// The scalar of the listing: f32 as printed, f64 to judge its formulas without its roundings.
pub trait Real:
    Copy
    + std::fmt::Debug
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Rounds to the scalar.
    fn of(x: f64) -> Self;
    /// Widens, exactly.
    fn wide(self) -> f64;
    /// The square root, correctly rounded.
    fn sqrt(self) -> Self;
}

impl Real for f32 {
    fn of(x: f64) -> Self {
        x as Self
    }
    fn wide(self) -> f64 {
        f64::from(self)
    }
    fn sqrt(self) -> Self {
        self.sqrt()
    }
}

impl Real for f64 {
    fn of(x: f64) -> Self {
        x
    }
    fn wide(self) -> f64 {
        self
    }
    fn sqrt(self) -> Self {
        self.sqrt()
    }
}

/// A row of two.
pub type Vector2<T> = [T; 2];
/// A row of three.
pub type Vector3<T> = [T; 3];
/// A row of four: x, y, z, w.
pub type Vector4<T> = [T; 4];
/// Rows of a 2x2 matrix.
pub type Matrix2<T> = [[T; 2]; 2];
/// Rows of a 3x3 matrix.
pub type Matrix3<T> = [[T; 3]; 3];
/// Rows of a 4x4 matrix.
pub type Matrix4<T> = [[T; 4]; 4];

/// How the z of homogeneous screen space follows from the depth w: the listing leaves it open (E3, E4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DepthMap {
    /// z/w runs from -1 at the near plane to 1 at the far plane.
    OpenGl {
        /// Depth of the near plane.
        near: f64,
        /// Depth of the far plane.
        far: f64,
    },
    /// z/w runs from 0 at the near plane to 1 at the far plane.
    Direct3d {
        /// Depth of the near plane.
        near: f64,
        /// Depth of the far plane.
        far: f64,
    },
    /// z/w runs from 1 at the near plane to 0 at the far plane.
    ReversedZ {
        /// Depth of the near plane.
        near: f64,
        /// Depth of the far plane.
        far: f64,
    },
}

impl DepthMap {
    /// (A, B) of z = A w + B.
    pub fn coefficients(self) -> (f64, f64) {
        match self {
            Self::OpenGl { near, far } => ((far + near) / (far - near), -2.0 * far * near / (far - near)),
            Self::Direct3d { near, far } => (far / (far - near), -far * near / (far - near)),
            Self::ReversedZ { near, far } => (-near / (far - near), far * near / (far - near)),
        }
    }

    /// Depths of the near and far planes.
    pub fn planes(self) -> (f64, f64) {
        match self {
            Self::OpenGl { near, far } | Self::Direct3d { near, far } | Self::ReversedZ { near, far } => {
                (near, far)
            }
        }
    }

    /// The row-vector matrix of a perspective camera at the origin that looks along +z, with screen units of
    /// tan (x and y pass unchanged): the only one for which the listing's lens is round (E12, E13).
    pub fn perspective(self) -> Matrix4<f64> {
        let (a, b) = self.coefficients();
        [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, a, 1.0], [0.0, 0.0, b, 0.0]]
    }
}

/// A clip plane of homogeneous screen space (L16): a point q is inside where (q - origin).normal >= 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClipPlane<T> {
    /// A point of the plane.
    pub origin: Vector4<T>,
    /// The inward normal.
    pub normal: Vector4<T>,
}

/// The parameters of L1 to L30.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameters<T> {
    /// L2 `F`: the cutoff.
    pub cutoff: T,
    /// L3 `conditionThreshold`: never used (E29).
    pub condition_threshold: T,
    /// L4 `prefiltersize`, in pixels as L144 uses it (E30).
    pub prefilter_size: T,
    /// L5 `focus`.
    pub focus: T,
    /// L6 `aperture`: the f-number.
    pub aperture: T,
    /// L7 `imagePlane`: always 1.
    pub image_plane: T,
    /// L8 `subpixels`: samples in a pixel.
    pub subpixels: usize,
    /// L10 `objectToScreen`.
    pub object_to_screen: Matrix4<T>,
    /// L11 `vpScale`.
    pub vp_scale: Vector2<T>,
    /// L12 `vpMid`.
    pub vp_mid: Vector2<T>,
    /// L13 `scissorxmin`, `scissorymin`: inclusive.
    pub scissor_min: [i64; 2],
    /// L13 `scissorxmax`, `scissorymax`: exclusive, as L171 uses them (E27).
    pub scissor_max: [i64; 2],
    /// L16 `clipOrigin`, `clipNormal`.
    pub clip_planes: Vec<ClipPlane<T>>,
    /// L18 `exptablesize`.
    pub exp_table_size: usize,
    /// L23 `prefilterJitter`, in pixels.
    pub prefilter_jitter: Vec<Vector2<T>>,
    /// L24 `lensJitter`, in scene units as L181 uses it (E14).
    pub lens_jitter: Vec<Vector2<T>>,
    /// L27 `selSize`: a power of two, because L172 masks with selSize - 1.
    pub sel_size: usize,
    /// L28 `prefilterSelection`.
    pub prefilter_selection: Vec<usize>,
    /// L29 `doffilterSelection`.
    pub lens_selection: Vec<usize>,
    /// L150 `width`: undeclared (E27).
    pub width: i64,
    /// L156 `height`: undeclared (E27).
    pub height: i64,
}

impl<T: Real> Parameters<T> {
    /// The listing's usual values for a camera at the origin that looks along +z: screen units of tan, square
    /// pixels, `focal` pixels to a unit, the optical axis in the middle of the picture; F = 2, prefilter 1
    /// pixel, f/2.8 focused at 5, 256 table entries, six clip planes, and one sample a pixel in its centre
    /// through the lens's centre.
    pub fn new(depth: DepthMap, width: usize, height: usize, focal: f64) -> Self {
        let t = T::of;
        let (near, far) = depth.planes();
        let half = [width as f64 / (2.0 * focal), height as f64 / (2.0 * focal)];
        Self {
            cutoff: t(2.0),
            condition_threshold: t(100.0),
            prefilter_size: t(1.0),
            focus: t(5.0),
            aperture: t(2.8),
            image_plane: t(1.0),
            subpixels: 1,
            object_to_screen: depth.perspective().map(|row| row.map(t)),
            vp_scale: [t(focal), t(focal)],
            vp_mid: [t(width as f64 / 2.0), t(height as f64 / 2.0)],
            scissor_min: [0, 0],
            scissor_max: [width as i64, height as i64],
            clip_planes: frustum(half, near, far),
            exp_table_size: 256,
            prefilter_jitter: vec![[t(0.5), t(0.5)]],
            lens_jitter: vec![[t(0.0), t(0.0)]],
            sel_size: 1,
            prefilter_selection: vec![0],
            lens_selection: vec![0],
            width: width as i64,
            height: height as i64,
        }
    }

    /// Sets one pattern of samples, the same for every pixel: pairs of a pixel offset and a lens point.
    pub fn with_pattern(mut self, samples: &[(Vector2<f64>, Vector2<f64>)]) -> Self {
        self.subpixels = samples.len();
        self.prefilter_jitter = samples.iter().map(|s| s.0.map(T::of)).collect();
        self.lens_jitter = samples.iter().map(|s| s.1.map(T::of)).collect();
        self.sel_size = 1;
        self.prefilter_selection = vec![0];
        self.lens_selection = vec![0];
        self
    }
}

/// Left, right, top, bottom, near and far plane of a view with the half sizes `half` in screen units.
pub fn frustum<T: Real>(half: [f64; 2], near: f64, far: f64) -> Vec<ClipPlane<T>> {
    let plane = |origin: Vector4<f64>, normal: Vector4<f64>| ClipPlane {
        origin: origin.map(T::of),
        normal: normal.map(T::of),
    };
    let eye = [0.0; 4];
    vec![
        plane(eye, [1.0, 0.0, 0.0, half[0]]),
        plane(eye, [-1.0, 0.0, 0.0, half[0]]),
        plane(eye, [0.0, 1.0, 0.0, half[1]]),
        plane(eye, [0.0, -1.0, 0.0, half[1]]),
        plane([0.0, 0.0, 0.0, near], [0.0, 0.0, 0.0, 1.0]),
        plane([0.0, 0.0, 0.0, far], [0.0, 0.0, 0.0, -1.0]),
    ]
}

/// One entry of the listing's `splats`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ListingSplat<T> {
    /// L46 `position`.
    pub position: Vector3<T>,
    /// L47 `normal`: unit length.
    pub normal: Vector3<T>,
    /// L55 `size`: sigma.
    pub size: T,
    /// What the shader of L162 would set.
    pub color: Vector4<T>,
}

impl<T: Real> ListingSplat<T> {
    /// A white splat, rounded from f64.
    pub fn new(position: Vector3<f64>, normal: Vector3<f64>, size: f64) -> Self {
        Self {
            position: position.map(T::of),
            normal: normal.map(T::of),
            size: T::of(size),
            color: [T::of(1.0); 4],
        }
    }
}

/// A splat's tangent frame in homogeneous screen space: what L53 to L69 make.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TangentFrame<T> {
    /// L57 `Q`: the conic, r^2 = (u v) Q (u v)^t. Always isotropic in the listing; a test may pass another.
    pub q: Matrix2<T>,
    /// L67 `tuh`.
    pub tuh: Vector4<T>,
    /// L68 `tvh`.
    pub tvh: Vector4<T>,
    /// L69 `p0h`.
    pub p0h: Vector4<T>,
}

/// Which `continue` a splat takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Culled {
    /// L52.
    BackFace,
    /// L84, by the clip plane of this index.
    Frustum(usize),
    /// L150.
    OutsideX,
    /// L153.
    EmptyX,
    /// L156.
    OutsideY,
    /// L159.
    EmptyY,
}

/// L106 to L125: the conic of the screen and its bounding rectangle, in screen units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds<T> {
    /// L106 `Qhs`.
    pub qhs: Matrix3<T>,
    /// L111 `delta`.
    pub delta: T,
    /// `xmin` after L125.
    pub xmin: T,
    /// `xmax` after L125.
    pub xmax: T,
    /// `ymin` after L125.
    pub ymin: T,
    /// `ymax` after L125.
    pub ymax: T,
}

/// Everything the listing knows of a splat before it rasterises it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SetUp<T> {
    /// The `continue` the splat takes first, if any.
    pub culled: Option<Culled>,
    /// L51: `Dot(c, pleq)`; NaN where a test entered at [`Listing::set_up_frame`].
    pub dot: T,
    /// L51 `dotSign`: the sign bit of `dot`.
    pub dot_sign: bool,
    /// L53 to L69.
    pub frame: TangentFrame<T>,
    /// L87 `M`.
    pub m: Matrix3<T>,
    /// L90 `detM`.
    pub det_m: T,
    /// L93 `Mi`: the adjugate of `M`.
    pub mi: Matrix3<T>,
    /// L106 to L125.
    pub bounds: Bounds<T>,
    /// L128 to L134 `zmin`.
    pub zmin: T,
    /// L128 to L134 `zmax`.
    pub zmax: T,
    /// L141 `coc`, in screen units.
    pub coc: T,
    /// L144 to L147: `xmin`, `ymin`, `xmax`, `ymax` in pixels.
    pub pixels: [T; 4],
    /// L149 to L158: `sx`, `sy` after scissoring.
    pub first: [i64; 2],
    /// L149 to L158: `ex`, `ey` after scissoring; exclusive.
    pub end: [i64; 2],
    /// L161: `color`.
    pub color: Vector4<T>,
}

/// What L178 to L196 find for one sample ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayResult<T> {
    /// L186 `uv`: the homogeneous point of the splat's plane.
    pub uv: Vector3<T>,
    /// L190 `radius`, before the division by uv.z^2.
    pub radius: T,
    /// Whether L191 lets the sample pass.
    pub inside: bool,
    /// L193 `z`; infinite or NaN where uv.z is zero.
    pub z: T,
    /// Whether L191 and L194 both pass: the listing appends a fragment.
    pub accepted: bool,
    /// L196: the index into the table.
    pub table_index: i64,
    /// L196: the weight; `None` if the index is outside the table (E17).
    pub weight: Option<T>,
}

/// L198: one call of `appendFragment`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ListingFragment<T> {
    /// The splat's index.
    pub splat: usize,
    /// The pixel's column.
    pub x: i64,
    /// The pixel's row.
    pub y: i64,
    /// The sample's index in its pixel.
    pub j: usize,
    /// L166.
    pub color: Vector4<T>,
    /// L196; `None` where the listing reads past its table (E17).
    pub weight: Option<T>,
    /// L197: clip z (E3).
    pub z: T,
    /// L167.
    pub zmin: T,
    /// L168.
    pub zmax: T,
    /// L169.
    pub dot_sign: bool,
    /// The ray's results.
    pub ray: RayResult<T>,
    /// L178: the index into `prefilter_jitter`.
    pub prefilter_index: usize,
    /// L181: the index into `lens_jitter`.
    pub lens_index: usize,
}

/// The listing with its constants (L31 to L43) computed.
#[derive(Clone, Debug)]
pub struct Listing<T> {
    /// L1 to L30.
    pub parameters: Parameters<T>,
    /// L32 `focalLength`.
    pub focal_length: T,
    /// L33 `lensRadius`: never used (E14).
    pub lens_radius: T,
    /// L34 `exptablescale`.
    pub exp_table_scale: T,
    /// L36 `oovpScale`.
    pub oo_vp_scale: Vector2<T>,
    /// L38 `Vp`: never used (E29).
    pub vp: Matrix2<T>,
    /// L41 to L43 `c`: the eye, or the direction to the viewer with w = 0.
    pub eye: Vector4<T>,
    /// L19 `exptable`.
    pub exp_table: Vec<T>,
}

impl<T: Real> Listing<T> {
    /// L31 to L43.
    pub fn new(parameters: Parameters<T>) -> Self {
        let (zero, one, half) = (T::of(0.0), T::of(1.0), T::of(0.5));
        let p = &parameters;
        // L32-L34
        let focal_length = p.image_plane * p.focus / (p.image_plane + p.focus);
        let lens_radius = focal_length * half / p.aperture;
        let exp_table_scale = T::of(p.exp_table_size as f64) / p.cutoff;
        // L36-L39
        let oo_vp_scale = [one / p.vp_scale[0], one / p.vp_scale[1]];
        let vp = [
            [p.prefilter_size * oo_vp_scale[0] * oo_vp_scale[0], zero],
            [zero, p.prefilter_size * oo_vp_scale[1] * oo_vp_scale[1]],
        ];
        // L40-L43
        let mut c = invert4(&p.object_to_screen)[2];
        if c[3] != zero {
            let s = one / c[3];
            c = c.map(|x| x * s);
        } else {
            c = c.map(|x| -x);
        }
        // L19
        let exp_table = (0..p.exp_table_size)
            .map(|i| {
                let x = T::of(-0.5) * p.cutoff * T::of(i as f64) / T::of(p.exp_table_size as f64);
                T::of(libm::exp(x.wide()))
            })
            .collect();
        Self { focal_length, lens_radius, exp_table_scale, oo_vp_scale, vp, eye: c, exp_table, parameters }
    }

    /// L45 to L203: all splats, every fragment into the sink.
    pub fn run(&self, splats: &[ListingSplat<T>], mut sink: impl FnMut(ListingFragment<T>)) {
        for (i, splat) in splats.iter().enumerate() {
            let set_up = self.set_up(splat);
            if set_up.culled.is_none() {
                self.rasterise(i, &set_up, &mut sink);
            }
        }
    }

    /// L46 to L161 for one splat.
    pub fn set_up(&self, splat: &ListingSplat<T>) -> SetUp<T> {
        let (zero, one) = (T::of(0.0), T::of(1.0));
        // L46-L47
        let (p0, n) = (splat.position, splat.normal);
        // L49-L52
        let pleq = [n[0], n[1], n[2], -dot(&p0, &n)];
        let facing = dot(&self.eye, &pleq);
        let dot_sign = facing.wide().is_sign_negative();
        // L54-L57
        let q = conic_of(&[[splat.size, zero], [zero, splat.size]]);
        // L59-L61
        let tu = normalize(perpendicular(n));
        let tv = cross(n, tu);
        // L63-L69
        let o = &self.parameters.object_to_screen;
        let tuh = row_times4(&[tu[0], tu[1], tu[2], zero], o);
        let tvh = row_times4(&[tv[0], tv[1], tv[2], zero], o);
        let p0h = row_times4(&[p0[0], p0[1], p0[2], one], o);

        let mut s = self.set_up_frame(&TangentFrame { q, tuh, tvh, p0h });
        s.dot = facing;
        s.dot_sign = dot_sign;
        s.color = splat.color;
        if dot_sign {
            s.culled = Some(Culled::BackFace);
        }
        s
    }

    /// L71 to L161, for any conic and any tangents: the listing's own are isotropic, but its formulas are
    /// written for a general Q.
    pub fn set_up_frame(&self, frame: &TangentFrame<T>) -> SetUp<T> {
        let p = &self.parameters;
        let TangentFrame { q, tuh, tvh, p0h } = frame;
        let mut culled = None;
        let mut leave = |why| culled = culled.or(Some(why));

        // L71-L84
        let mut cp = 0;
        while cp < p.clip_planes.len() {
            if behind(&p.clip_planes[cp], p.cutoff, frame) {
                break;
            }
            cp += 1;
        }
        if cp < p.clip_planes.len() {
            leave(Culled::Frustum(cp));
        }

        // L86-L106
        let m = [[tuh[0], tuh[1], tuh[3]], [tvh[0], tvh[1], tvh[3]], [p0h[0], p0h[1], p0h[3]]];
        let det_m = det3(&m);
        let mi = inverse_times_det(&m);
        // L108-L125
        let bounds = bounding_rectangle(&mi, q, p.cutoff);
        // L127-L134
        let (zmin, zmax) = depth_range(q, p.cutoff, tuh[3], tvh[3], p0h[3]);
        // L136-L141
        let coc = circle_of_confusion(self.focal_length, p.image_plane, p.aperture, zmin, zmax);

        // L143-L147
        let xmin = (bounds.xmin - coc) * p.vp_scale[0] + p.vp_mid[0] - p.prefilter_size;
        let xmax = (bounds.xmax + coc) * p.vp_scale[0] + p.vp_mid[0] + p.prefilter_size;
        let ymin = (bounds.ymin - coc) * p.vp_scale[1] + p.vp_mid[1] - p.prefilter_size;
        let ymax = (bounds.ymax + coc) * p.vp_scale[1] + p.vp_mid[1] + p.prefilter_size;

        // L149-L153
        let (mut sx, mut ex) = (floor(xmin), ceil(xmax));
        if sx >= p.width || ex <= 0 {
            leave(Culled::OutsideX);
        }
        sx = sx.max(p.scissor_min[0]);
        ex = ex.min(p.scissor_max[0]);
        if ex - sx == 0 {
            leave(Culled::EmptyX);
        }
        // L155-L159
        let (mut sy, mut ey) = (floor(ymin), ceil(ymax));
        if sy >= p.height || ey <= 0 {
            leave(Culled::OutsideY);
        }
        sy = sy.max(p.scissor_min[1]);
        ey = ey.min(p.scissor_max[1]);
        if ey - sy == 0 {
            leave(Culled::EmptyY);
        }

        SetUp {
            culled,
            dot: T::of(f64::NAN),
            dot_sign: false,
            frame: *frame,
            m,
            det_m,
            mi,
            bounds,
            zmin,
            zmax,
            coc,
            pixels: [xmin, ymin, xmax, ymax],
            first: [sx, sy],
            end: [ex, ey],
            color: [T::of(0.0), T::of(0.0), T::of(0.0), T::of(1.0)], // L161
        }
    }

    /// L164 to L202: the pixels and samples of one splat. Ignores [`SetUp::culled`].
    pub fn rasterise(&self, splat: usize, s: &SetUp<T>, sink: &mut impl FnMut(ListingFragment<T>)) {
        let p = &self.parameters;
        // L170-L171
        for y in s.first[1]..s.end[1] {
            for x in s.first[0]..s.end[0] {
                // L172-L173
                let mask = p.sel_size as i64 - 1;
                let cell = (y & mask) as usize * p.sel_size + (x & mask) as usize;
                let aapattern = p.prefilter_selection[cell];
                let dofpattern = p.lens_selection[cell];
                // L174-L175
                let sp = [
                    (T::of(x as f64) - p.vp_mid[0]) * self.oo_vp_scale[0],
                    (T::of(y as f64) - p.vp_mid[1]) * self.oo_vp_scale[1],
                ];
                for j in 0..p.subpixels {
                    // L177-L179 (E15: the pattern's index is not multiplied by `subpixels`)
                    let (prefilter_index, lens_index) = (aapattern + j, dofpattern + j);
                    let jitter = p.prefilter_jitter[prefilter_index];
                    let at =
                        [sp[0] + jitter[0] * self.oo_vp_scale[0], sp[1] + jitter[1] * self.oo_vp_scale[1]];
                    // L180-L196
                    let ray = self.cast(s, at, p.lens_jitter[lens_index]);
                    if ray.accepted {
                        // L165-L169, L196-L198
                        sink(ListingFragment {
                            splat,
                            x,
                            y,
                            j,
                            color: s.color,
                            weight: ray.weight,
                            z: ray.z,
                            zmin: s.zmin,
                            zmax: s.zmax,
                            dot_sign: s.dot_sign,
                            ray,
                            prefilter_index,
                            lens_index,
                        });
                    }
                }
            }
        }
    }

    /// L178 to L196: the ray of the screen point `at` through the lens point `lens` (scene units).
    pub fn cast(&self, s: &SetUp<T>, at: Vector2<T>, lens: Vector2<T>) -> RayResult<T> {
        let (zero, one, two) = (T::of(0.0), T::of(1.0), T::of(2.0));
        let params = &self.parameters;
        let (q, frame) = (&s.frame.q, &s.frame);
        // L178-L180
        let mut f = [at[0], at[1], one].map(|x| x * params.focus);
        // L181-L183
        let mut p = [lens[0], lens[1], zero];
        for (f, p) in f.iter_mut().zip(p) {
            *f = *f - p;
        }
        // L184-L185
        f = row_times3(&f, &s.mi);
        p = row_times3(&p, &s.mi);
        // L186-L188
        let uv = [
            s.det_m * f[0] - f[0] * p[2] + f[2] * p[0],
            s.det_m * f[1] - f[1] * p[2] + f[2] * p[1],
            s.det_m * f[2],
        ];
        // L190
        let radius = q[0][0] * uv[0] * uv[0] + two * q[0][1] * uv[0] * uv[1] + q[1][1] * uv[1] * uv[1];
        // L191
        let inside = radius < params.cutoff * uv[2] * uv[2];
        // L192-L193
        let ooh = one / uv[2];
        let z = frame.p0h[2] + uv[0] * ooh * frame.tuh[2] + uv[1] * ooh * frame.tvh[2];
        // L194-L196
        let table_index = self.table_index(radius, ooh);
        let weight = usize::try_from(table_index).ok().and_then(|i| self.exp_table.get(i).copied());
        RayResult { uv, radius, inside, z, accepted: inside && z > zero, table_index, weight }
    }

    /// L195 and L196: the table's index of `radius`, with `ooh` = 1/uv.z. May be one past the end (E17).
    pub fn table_index(&self, radius: T, ooh: T) -> i64 {
        let radius = radius * (ooh * ooh * self.exp_table_scale);
        floor(radius).max(0)
    }
}

/// L54 to L57: the conic of a variance root `Vr`: the inverse of Vr Vr^t.
pub fn conic_of<T: Real>(vr: &Matrix2<T>) -> Matrix2<T> {
    let entry = |i: usize, j: usize| vr[i][0] * vr[j][0] + vr[i][1] * vr[j][1];
    let v = [[entry(0, 0), entry(0, 1)], [entry(1, 0), entry(1, 1)]];
    let s = T::of(1.0) / (v[0][0] * v[1][1] - v[0][1] * v[1][0]);
    [[v[1][1] * s, -(v[0][1] * s)], [-(v[1][0] * s), v[0][0] * s]]
}

/// L73 to L82: whether the whole splat is behind a clip plane.
pub fn behind<T: Real>(plane: &ClipPlane<T>, cutoff: T, frame: &TangentFrame<T>) -> bool {
    let (zero, two) = (T::of(0.0), T::of(2.0));
    let q = &frame.q;
    // L73-L75
    let a = dot(&frame.tuh, &plane.normal);
    let b = dot(&frame.tvh, &plane.normal);
    let c_plane = dot(&frame.p0h, &plane.normal) - dot(&plane.normal, &plane.origin);
    if a == zero && b == zero {
        // L76-L77
        c_plane < zero
    } else {
        // L79-L81
        let det_q = q[0][0] * q[1][1] - q[0][1] * q[1][0];
        c_plane < zero
            && cutoff * (q[0][0] * b * b - two * q[0][1] * a * b + q[1][1] * a * a)
                - c_plane * c_plane * det_q
                < zero
    }
}

/// L93 to L101: `Mi`, the inverse of M times Det(M).
pub fn inverse_times_det<T: Real>(m: &Matrix3<T>) -> Matrix3<T> {
    [
        [
            m[1][1] * m[2][2] - m[2][1] * m[1][2],
            m[2][1] * m[0][2] - m[0][1] * m[2][2],
            m[0][1] * m[1][2] - m[1][1] * m[0][2],
        ],
        [
            m[2][0] * m[1][2] - m[1][0] * m[2][2],
            m[0][0] * m[2][2] - m[2][0] * m[0][2],
            m[1][0] * m[0][2] - m[0][0] * m[1][2],
        ],
        [
            m[1][0] * m[2][1] - m[2][0] * m[1][1],
            m[2][0] * m[0][1] - m[0][0] * m[2][1],
            m[0][0] * m[1][1] - m[1][0] * m[0][1],
        ],
    ]
}

/// L103 to L125: the conic of the screen and its box.
pub fn bounding_rectangle<T: Real>(mi: &Matrix3<T>, q: &Matrix2<T>, cutoff: T) -> Bounds<T> {
    let (zero, one) = (T::of(0.0), T::of(1.0));
    // L103-L106
    let qh = [[q[0][0], q[0][1], zero], [q[1][0], q[1][1], zero], [zero, zero, -cutoff]];
    let mq = [row_times3(&mi[0], &qh), row_times3(&mi[1], &qh), row_times3(&mi[2], &qh)];
    let mut qhs = [[zero; 3]; 3];
    for (row, mq) in qhs.iter_mut().zip(&mq) {
        for (entry, mi) in row.iter_mut().zip(mi) {
            *entry = dot(mq, mi);
        }
    }
    // L109-L111
    let (mut xmin, mut xmax) = (-one, one);
    let (mut ymin, mut ymax) = (-one, one);
    let delta = qhs[0][0] * qhs[1][1] - qhs[0][1] * qhs[1][0];
    if delta > zero {
        // L113-L116
        let oodelta = one / delta;
        let xt = (qhs[0][1] * qhs[1][2] - qhs[1][1] * qhs[0][2]) * oodelta;
        let yt = (qhs[0][1] * qhs[0][2] - qhs[0][0] * qhs[1][2]) * oodelta;
        let f = -qhs[2][2] - xt * qhs[0][2] - yt * qhs[1][2];
        // L118-L119
        let bx = (qhs[1][1] * f * oodelta).sqrt();
        let by = (qhs[0][0] * f * oodelta).sqrt();
        // L121-L124
        xmin = xt - bx;
        xmax = xt + bx;
        ymin = yt - by;
        ymax = yt + by;
    }
    Bounds { qhs, delta, xmin, xmax, ymin, ymax }
}

/// L127 to L134: `zmin` and `zmax`.
pub fn depth_range<T: Real>(q: &Matrix2<T>, cutoff: T, tu_w: T, tv_w: T, p0_w: T) -> (T, T) {
    let (zero, two) = (T::of(0.0), T::of(2.0));
    let (mut zmin, mut zmax) = (p0_w, p0_w);
    let mut l = q[0][0] * tu_w * tu_w + two * q[0][1] * tu_w * tv_w + q[1][1] * tv_w * tv_w;
    if l != zero {
        l = maximum(zero, cutoff / l).sqrt();
        zmin = p0_w - l * (tu_w * tu_w + tv_w * tv_w);
        zmax = p0_w + l * (tu_w * tu_w + tv_w * tv_w);
    }
    (zmin, zmax)
}

/// L136 to L141: `coc`, half the diameter, in screen units.
pub fn circle_of_confusion<T: Real>(focal_length: T, image_plane: T, aperture: T, zmin: T, zmax: T) -> T {
    // L137-L138
    let focus_dist_zmin = focal_length * zmin / (zmin - focal_length);
    let focus_dist_zmax = focal_length * zmax / (zmax - focal_length);
    // L139-L140
    let coc_zmin = absolute(focus_dist_zmin - image_plane) * focal_length / (aperture * focus_dist_zmin);
    let coc_zmax = absolute(focus_dist_zmax - image_plane) * focal_length / (aperture * focus_dist_zmax);
    // L141
    T::of(0.5) * maximum(coc_zmin, coc_zmax)
}

/// L60 `Perpendicular`: not defined by the listing. Here n x the axis of n's least component, so that it is
/// never zero. An isotropic splat does not depend on the choice.
pub fn perpendicular<T: Real>(n: Vector3<T>) -> Vector3<T> {
    let (zero, one) = (T::of(0.0), T::of(1.0));
    let [x, y, z] = n.map(absolute);
    let axis = if x <= y && x <= z {
        [one, zero, zero]
    } else if y <= z {
        [zero, one, zero]
    } else {
        [zero, zero, one]
    };
    cross(n, axis)
}

/// The C macro MAX: the second argument if either is NaN.
fn maximum<T: Real>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

fn absolute<T: Real>(x: T) -> T {
    T::of(x.wide().abs())
}

/// `int i = floor(x)`; saturating.
fn floor<T: Real>(x: T) -> i64 {
    x.wide().floor() as i64
}

/// `int i = ceil(x)`; saturating.
fn ceil<T: Real>(x: T) -> i64 {
    x.wide().ceil() as i64
}

fn dot<T: Real, const N: usize>(a: &[T; N], b: &[T; N]) -> T {
    let mut sum = a[0] * b[0];
    for i in 1..N {
        sum = sum + a[i] * b[i];
    }
    sum
}

fn cross<T: Real>(a: Vector3<T>, b: Vector3<T>) -> Vector3<T> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn normalize<T: Real>(a: Vector3<T>) -> Vector3<T> {
    let s = T::of(1.0) / dot(&a, &a).sqrt();
    a.map(|x| x * s)
}

fn det3<T: Real>(m: &Matrix3<T>) -> T {
    dot(&m[0], &cross(m[1], m[2]))
}

fn row_times3<T: Real>(v: &Vector3<T>, m: &Matrix3<T>) -> Vector3<T> {
    [0, 1, 2].map(|j| v[0] * m[0][j] + v[1] * m[1][j] + v[2] * m[2][j])
}

fn row_times4<T: Real>(v: &Vector4<T>, m: &Matrix4<T>) -> Vector4<T> {
    [0, 1, 2, 3].map(|j| v[0] * m[0][j] + v[1] * m[1][j] + v[2] * m[2][j] + v[3] * m[3][j])
}

/// L40 `Invert`: Gauss and Jordan with partial pivoting. A singular matrix gives infinities or NaN.
fn invert4<T: Real>(m: &Matrix4<T>) -> Matrix4<T> {
    let (zero, one) = (T::of(0.0), T::of(1.0));
    let mut a = *m;
    let mut inverse = [[zero; 4]; 4];
    for (i, row) in inverse.iter_mut().enumerate() {
        row[i] = one;
    }
    for column in 0..4 {
        let mut pivot = column;
        for row in column + 1..4 {
            if absolute(a[row][column]) > absolute(a[pivot][column]) {
                pivot = row;
            }
        }
        a.swap(column, pivot);
        inverse.swap(column, pivot);
        let s = one / a[column][column];
        a[column] = a[column].map(|x| x * s);
        inverse[column] = inverse[column].map(|x| x * s);
        for row in (0..4).filter(|&row| row != column) {
            let factor = a[row][column];
            for k in 0..4 {
                a[row][k] = a[row][k] - factor * a[column][k];
                inverse[row][k] = inverse[row][k] - factor * inverse[column][k];
            }
        }
    }
    inverse
}

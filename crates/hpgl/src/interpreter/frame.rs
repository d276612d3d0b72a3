//! Frames: user units, plotter units, and millimetres on the page.
//!
//! ```text
//! user units --SC, P1, P2--> plotter units --RO, unit--> mm
//! ```
//!
//! The pen position is kept in plotter units, which neither SC nor IP moves.

use drawing::{Affine, Point, Rect, Vec2};

use crate::profile::{Options, Paper};
use crate::summary::{Profile, ProfileReason};

/// The ranges that `SC` gave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Scale {
    /// Both scaling points have the given user coordinates.
    Anisotropic { x: (f64, f64), y: (f64, f64) },
    /// As large as fits with equal units; what is left over of the area is put `left` and `bottom`
    /// percent before it.
    Isotropic { x: (f64, f64), y: (f64, f64), left: f64, bottom: f64 },
    /// P1 has the given user coordinates, and a user unit that many plotter units.
    PointFactor { origin: (f64, f64), factor: (f64, f64) },
}

/// Quarter turns of the coordinate system.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Rotation {
    #[default]
    R0,
    R90,
    R180,
    R270,
}

impl Rotation {
    pub(crate) fn from_degrees(degrees: f64) -> Option<Self> {
        match degrees {
            0.0 => Some(Self::R0),
            90.0 => Some(Self::R90),
            180.0 => Some(Self::R180),
            270.0 => Some(Self::R270),
            _ => None,
        }
    }

    fn swaps(self) -> bool {
        matches!(self, Self::R90 | Self::R270)
    }
}

/// The window that `IW` set.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Window {
    plu: Rect,
    /// Its corners in user units, where it was given in them: it moves with the scale.
    user: Option<Rect>,
}

/// A map that stretches and shifts each axis by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
struct AxisMap {
    factor: Vec2,
    shift: Vec2,
}

impl AxisMap {
    const IDENTITY: Self = Self { factor: Vec2::new(1.0, 1.0), shift: Vec2::ZERO };
}

/// How the two lengths of `PS` lie.
///
/// GhostPDL has the first one along x. CAD files exist that name the shorter one first and draw with x
/// along the longer one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PageAxes {
    /// The first one along x.
    AsWritten,
    LongerAlongX,
}

/// The map from coordinates of the file to the page.
#[derive(Clone, Debug)]
#[expect(clippy::struct_excessive_bools, reason = "independent facts about the file")]
pub(crate) struct Frame {
    unit_mm: f64,
    /// The file may choose the plotter.
    automatic: bool,
    default_points: (Point, Point),
    default_hard_clip: Rect,
    /// The area that the plotter reaches, unrotated plotter units.
    hard_clip: Rect,
    /// Unless the file set a page, its edges do not clip; a page of one length is open towards y.
    page_clip: Option<Rect>,
    /// Ink is cut off where the plotter's pen cannot go.
    clips_at_limits: bool,
    page_set: bool,
    page_axes: PageAxes,
    /// `PS` set a page whose second length is the longer one.
    portrait_seen: bool,
    /// Width and height of the picture frame of PCL, and of the plot that is scaled to it; plotter
    /// units.
    pcl_size: Option<Vec2>,
    plot_size: (Option<f64>, Option<f64>),
    /// What the plot is scaled by in width and height.
    plot_scale: Vec2,
    /// Why the plotter is the one it is.
    reason: ProfileReason,
    /// P1 and P2 are those of the plotter, by nobody's word.
    points_assumed: bool,
    p1: Point,
    p2: Point,
    scale: Option<Scale>,
    rotation: Rotation,
    window: Option<Window>,
    user_to_plu: AxisMap,
    /// From plotter units of the turned frame to those of the page.
    turn: Affine,
    plu_to_mm: Affine,
    user_to_mm: Affine,
}

impl Frame {
    pub(crate) fn new(options: &Options, page_axes: PageAxes) -> Self {
        let mut frame = Self {
            unit_mm: options.plotter_unit_mm,
            automatic: options.automatic,
            default_points: options.scaling_points,
            default_hard_clip: options.hard_clip,
            hard_clip: options.hard_clip,
            page_clip: None,
            clips_at_limits: options.clips_at_limits,
            page_set: false,
            page_axes,
            portrait_seen: false,
            pcl_size: None,
            plot_size: (None, None),
            plot_scale: Vec2::new(1.0, 1.0),
            reason: if options.automatic { ProfileReason::Assumed } else { ProfileReason::Options },
            points_assumed: true,
            p1: options.scaling_points.0,
            p2: options.scaling_points.1,
            scale: None,
            rotation: Rotation::R0,
            window: None,
            user_to_plu: AxisMap::IDENTITY,
            turn: Affine::IDENTITY,
            plu_to_mm: Affine::IDENTITY,
            user_to_mm: Affine::IDENTITY,
        };
        frame.update();
        frame
    }

    /// What `IN` does: no rotation, no scale, no window, the default scaling points. The page
    /// stays.
    pub(crate) fn initialise(&mut self) {
        self.rotation = Rotation::R0;
        self.scale = None;
        self.window = None;
        self.reset_points();
    }

    /// What `DF` does: no scale, no window.
    pub(crate) fn set_defaults(&mut self) {
        self.scale = None;
        self.window = None;
        self.update();
    }

    /// A new sheet of the size that the plotter has by itself.
    pub(crate) fn forget_page(&mut self) {
        self.hard_clip = self.default_hard_clip;
        self.page_clip = None;
        self.page_set = false;
        self.pcl_size = None;
        self.plot_size = (None, None);
        self.plot_scale = Vec2::new(1.0, 1.0);
        self.reason = if self.automatic { ProfileReason::Assumed } else { ProfileReason::Options };
        self.initialise();
    }

    fn update(&mut self) {
        self.user_to_plu = self.scale.map_or(AxisMap::IDENTITY, |scale| self.scale_map(scale));
        let Rect { x0, y0, x1, y1 } = self.hard_clip;
        self.turn = match self.rotation {
            Rotation::R0 => Affine::IDENTITY,
            Rotation::R90 => Affine::new([0.0, 1.0, -1.0, 0.0, x0 + x1, 0.0]),
            Rotation::R180 => Affine::new([-1.0, 0.0, 0.0, -1.0, x0 + x1, y0 + y1]),
            Rotation::R270 => Affine::new([0.0, -1.0, 1.0, 0.0, 0.0, y0 + y1]),
        };
        let Vec2 { x, y } = self.unit_mm * self.plot_scale;
        self.plu_to_mm = Affine::scale_non_uniform(x, y) * self.turn;
        let AxisMap { factor, shift } = self.user_to_plu;
        self.user_to_mm = self.plu_to_mm * Affine::new([factor.x, 0.0, 0.0, factor.y, shift.x, shift.y]);
        if self.scale.is_some()
            && let Some(user) = self.window.and_then(|window| window.user)
        {
            let plu = Rect::from_points(
                self.plu_of_user(Point::new(user.x0, user.y0)),
                self.plu_of_user(Point::new(user.x1, user.y1)),
            );
            self.window = Some(Window { plu, user: Some(user) });
        }
    }

    fn scale_map(&self, scale: Scale) -> AxisMap {
        let (p1, extent) = (self.p1, self.p2 - self.p1);
        match scale {
            Scale::Anisotropic { x, y } => {
                let factor = Vec2::new(extent.x / (x.1 - x.0), extent.y / (y.1 - y.0));
                AxisMap { factor, shift: Vec2::new(p1.x - factor.x * x.0, p1.y - factor.y * y.0) }
            }
            Scale::Isotropic { x, y, left, bottom } => {
                let (range_x, range_y) = (x.1 - x.0, y.1 - y.0);
                let size = (extent.x / range_x).abs().min((extent.y / range_y).abs());
                let factor = Vec2::new(size.copysign(extent.x * range_x), size.copysign(extent.y * range_y));
                let slack = Vec2::new(extent.x - factor.x * range_x, extent.y - factor.y * range_y);
                let start = p1 + Vec2::new(slack.x * left / 100.0, slack.y * bottom / 100.0);
                AxisMap { factor, shift: Vec2::new(start.x - factor.x * x.0, start.y - factor.y * y.0) }
            }
            Scale::PointFactor { origin, factor } => AxisMap {
                factor: Vec2::new(factor.0, factor.1),
                shift: Vec2::new(p1.x - factor.0 * origin.0, p1.y - factor.1 * origin.1),
            },
        }
    }

    /// Plotter units of a point in current units.
    #[inline]
    pub(crate) fn plu_of_user(&self, p: Point) -> Point {
        let AxisMap { factor, shift } = self.user_to_plu;
        Point::new(factor.x * p.x + shift.x, factor.y * p.y + shift.y)
    }

    /// Plotter units of a step in current units.
    #[inline]
    pub(crate) fn plu_of_user_step(&self, v: Vec2) -> Vec2 {
        let factor = self.user_to_plu.factor;
        Vec2::new(factor.x * v.x, factor.y * v.y)
    }

    /// Current units of a point in plotter units. The scale is never singular.
    pub(crate) fn user_of_plu(&self, p: Point) -> Point {
        let AxisMap { factor, shift } = self.user_to_plu;
        Point::new((p.x - shift.x) / factor.x, (p.y - shift.y) / factor.y)
    }

    /// Millimetres on the page of a point in plotter units.
    #[inline]
    pub(crate) fn mm_of_plu(&self, p: Point) -> Point {
        self.plu_to_mm * p
    }

    /// The map from plotter units to millimetres on the page.
    pub(crate) fn plu_to_mm(&self) -> Affine {
        self.plu_to_mm
    }

    /// The map from current units to millimetres on the page.
    pub(crate) fn user_to_mm(&self) -> Affine {
        self.user_to_mm
    }

    /// Size of a plotter unit, mm.
    pub(crate) fn unit_mm(&self) -> f64 {
        self.unit_mm
    }

    /// The direction on the page of an angle in the turned frame, degrees.
    pub(crate) fn direction_mm(&self, degrees: f64) -> Vec2 {
        super::fill::direction_under(self.plu_to_mm, degrees)
    }

    /// P1 and P2, plotter units.
    pub(crate) fn points(&self) -> (Point, Point) {
        (self.p1, self.p2)
    }

    /// The area that the plotter reaches, in the rotated frame.
    pub(crate) fn reach(&self) -> Rect {
        self.turned(self.hard_clip)
    }

    fn turned(&self, rect: Rect) -> Rect {
        if self.rotation.swaps() { Rect::new(rect.y0, rect.x0, rect.y1, rect.x1) } else { rect }
    }

    /// Sets the scale. The pen stays where it is; a window given in user units turns to plotter
    /// units when the scale is taken away.
    pub(crate) fn set_scale(&mut self, scale: Option<Scale>) {
        if scale.is_none()
            && let Some(window) = &mut self.window
        {
            window.user = None;
        }
        self.scale = scale;
        self.update();
    }

    /// Sets P1 and P2; true if they had to be moved apart.
    pub(crate) fn set_points(&mut self, p1: Point, p2: Point) -> bool {
        self.points_assumed = false;
        let meet = (p1.x == p2.x, p1.y == p2.y);
        self.p1 = p1;
        self.p2 = p2 + Vec2::new(f64::from(u8::from(meet.0)), f64::from(u8::from(meet.1)));
        self.update();
        meet.0 || meet.1
    }

    /// The default P1 and P2 of the current rotation: corners of the page where the file set one,
    /// else the plotter's.
    pub(crate) fn reset_points(&mut self) {
        self.points_assumed = !self.page_set;
        let (p1, p2) = if self.page_set {
            (
                Point::new(self.hard_clip.x0, self.hard_clip.y0),
                Point::new(self.hard_clip.x1, self.hard_clip.y1),
            )
        } else {
            self.default_points
        };
        // The same two places on the paper, seen in the turned frame, lower left first.
        let Rect { x0, y0, x1, y1 } = self.hard_clip;
        let seen = |p: Point| match self.rotation {
            Rotation::R0 => p,
            Rotation::R90 => Point::new(p.y, x0 + x1 - p.x),
            Rotation::R180 => Point::new(x0 + x1 - p.x, y0 + y1 - p.y),
            Rotation::R270 => Point::new(y0 + y1 - p.y, p.x),
        };
        let (a, b) = (seen(p1), seen(p2));
        self.p1 = Point::new(a.x.min(b.x), a.y.min(b.y));
        self.p2 = Point::new(a.x.max(b.x), a.y.max(b.y));
        self.update();
    }

    /// Turns the frame. P1 and P2 keep their numbers; the result is where a point of the old frame
    /// lies in the new one.
    pub(crate) fn rotate(&mut self, rotation: Rotation, pen: Point) -> Point {
        let position = self.turn * pen;
        self.rotation = rotation;
        self.update();
        self.turn.inverse() * position
    }

    /// Sets the page, from the origin; P1 and P2 become its corners. A page of one length is a square
    /// that is open towards y.
    pub(crate) fn set_page(&mut self, length: f64, width: Option<f64>) {
        let is_portrait = width.is_some_and(|width| width > length);
        self.portrait_seen |= is_portrait;
        let (length, width) = match (self.page_axes, width) {
            (PageAxes::LongerAlongX, Some(width)) if is_portrait => (width, Some(length)),
            _ => (length, width),
        };
        self.hard_clip = Rect::new(0.0, 0.0, length, width.unwrap_or(length));
        let open = crate::units::SANE_PLU;
        self.page_clip = Some(match width {
            Some(width) => Rect::new(0.0, 0.0, length, width),
            None => Rect::new(0.0, -open, length, open),
        });
        self.page_set = true;
        self.reason = ProfileReason::PageSize;
        self.window = None;
        self.reset_points();
    }

    /// Takes paper of a plotter, if the file may choose: the default P1 and P2, and the area that
    /// the pen reaches.
    pub(crate) fn set_paper(&mut self, paper: &Paper) {
        if !self.automatic {
            return;
        }
        let [x1, y1, x2, y2] = paper.scaling_points;
        let [left, bottom, right, top] = paper.hard_clip;
        self.default_points = (Point::new(x1, y1), Point::new(x2, y2));
        self.hard_clip = Rect::new(left, bottom, right, top);
        self.reason = ProfileReason::PaperCode;
        if self.points_assumed {
            self.reset_points();
        }
    }

    /// The default P1 and P2 are the corners of the area that the pen reaches, as in HP-GL/2,
    /// if the file may choose.
    pub(crate) fn use_corners(&mut self) {
        if !self.automatic {
            return;
        }
        let Rect { x0, y0, x1, y1 } = self.hard_clip;
        self.default_points = (Point::new(x0, y0), Point::new(x1, y1));
        if self.reason == ProfileReason::Assumed {
            self.reason = ProfileReason::HpGl2;
        }
        if self.points_assumed {
            self.reset_points();
        }
    }

    /// The plotter that the file is read for, as it is now.
    pub(crate) fn profile(&self) -> Profile {
        let Rect { x0, y0, x1, y1 } = self.hard_clip;
        let corners = (Point::new(x0, y0), Point::new(x1, y1));
        Profile {
            scaling_points: if self.page_set { corners } else { self.default_points },
            hard_clip: self.hard_clip,
            unit_mm: self.unit_mm,
            reason: self.reason,
        }
    }

    /// Whether P1 and P2 are those of a plotter that the file does not name.
    pub(crate) fn points_are_assumed(&self) -> bool {
        self.points_assumed
    }

    /// Whether the order of the lengths of `PS` mattered.
    pub(crate) fn portrait_seen(&self) -> bool {
        self.portrait_seen
    }

    /// Whether the file set a page that ink is cut at.
    pub(crate) fn has_page(&self) -> bool {
        self.page_clip.is_some()
    }

    /// Whether the file set a window.
    pub(crate) fn has_window(&self) -> bool {
        self.window.is_some()
    }

    /// Makes the picture frame of PCL the page without clipping to it.
    pub(crate) fn set_picture_frame(&mut self, width: f64, height: f64) {
        self.pcl_size = Some(Vec2::new(width, height));
        self.scale_to_frame();
    }

    /// Sets the size of the plot that is scaled to the picture frame, plotter units: 0 makes it that of
    /// the frame again, NaN leaves it as it is.
    pub(crate) fn set_plot_size(&mut self, width: f64, height: f64) {
        let set = |size: f64, before| if size.is_nan() { before } else { (size > 0.0).then_some(size) };
        self.plot_size = (set(width, self.plot_size.0), set(height, self.plot_size.1));
        self.scale_to_frame();
    }

    /// The page in the plot's own units, and its scale: frame / plot size in width and height (HP, PCL 5
    /// Technical Reference, "HP-GL/2 Plot Horizontal Size").
    fn scale_to_frame(&mut self) {
        let Some(frame) = self.pcl_size else { return };
        let (width, height) = (self.plot_size.0.unwrap_or(frame.x), self.plot_size.1.unwrap_or(frame.y));
        self.plot_scale = Vec2::new(frame.x / width, frame.y / height);
        self.hard_clip = Rect::new(0.0, 0.0, width, height);
        self.page_set = true;
        self.reason = ProfileReason::PictureFrame;
        self.reset_points();
    }

    /// Sets the window by two corners in current units, or takes it away.
    pub(crate) fn set_window(&mut self, corners: Option<(Point, Point)>) {
        self.window = corners.map(|(a, b)| Window {
            plu: Rect::from_points(self.plu_of_user(a), self.plu_of_user(b)),
            user: self.scale.is_some().then_some(Rect { x0: a.x, y0: a.y, x1: b.x, y1: b.y }),
        });
    }

    /// The rectangle on the page that ink is clipped to, mm.
    pub(crate) fn clip(&self) -> Option<Rect> {
        let limits = self.clips_at_limits.then_some(self.hard_clip);
        let page = self.page_clip.or(limits).map(|page| self.turned(page));
        let plu = match (self.window.map(|window| window.plu), page) {
            (None, None) => return None,
            (Some(one), None) | (None, Some(one)) => one,
            (Some(window), Some(page)) => Rect {
                x0: window.x0.max(page.x0),
                y0: window.y0.max(page.y0),
                x1: window.x1.min(page.x1),
                y1: window.y1.min(page.y1),
            },
        };
        if plu.x1 <= plu.x0 || plu.y1 <= plu.y0 {
            return Some(Rect::ZERO);
        }
        Some(Rect::from_points(
            self.plu_to_mm * Point::new(plu.x0, plu.y0),
            self.plu_to_mm * Point::new(plu.x1, plu.y1),
        ))
    }
}

//! Footprints: the outlines of a destination raster's texels as polygons in a source raster.
//!
//! An edge is sampled until it is straight, always from left to right or from top to bottom, so that two texels
//! that share an edge share its polyline and no light is counted twice or lost between them.

use nalgebra::{Vector2, Vector3};

use crate::pixel::RasterPx;
use crate::raster::Raster;
use crate::remap::clip::{Polygon, bounds};

/// How far the middle of an edge may lie from its chord before the edge is divided. The middle is kept as a
/// vertex, so the polyline itself is straight to a quarter of this: 1/128 px.
const STRAIGHT_PX: f64 = 1.0 / 32.0;
/// The same for maps of the whole sphere: the octahedral map has creases, and the middle of an edge sees only part of
/// the bend of a crease beside it.
const STRAIGHT_OVER_CREASES_PX: f64 = STRAIGHT_PX / 4.0;
/// Longest step along an edge, so that no edge looks straight because its ends happen to lie well.
const MAX_STEP_RAD: f64 = 0.1;
/// Texels with a longer diagonal or a larger solid angle are divided before they are traced.
const MAX_DIAGONAL_RAD: f64 = 0.3;
const MAX_TEXEL_SR: f64 = 0.05;
const MAX_EDGE_DEPTH: u32 = 10;
/// How often a texel on the border of what the source sees is divided into four.
const MAX_BORDER_DEPTH: u32 = 4;
/// A part of such a texel this small in the source is not divided further.
const BORDER_PART_PX: f64 = 4.0;
/// Bound on the division of wide texels: the whole sphere in 4⁶ parts is well below either limit.
const MAX_WIDE_DEPTH: u32 = 6;

/// A place in the destination, with its direction and its position in the source where it has them.
#[derive(Clone, Copy)]
pub(crate) struct Sample {
    at: Vector2<f64>,
    direction: Option<Vector3<f64>>,
    position: Option<Vector2<f64>>,
}

impl Sample {
    /// Whether the destination has a direction there.
    pub fn has_direction(&self) -> bool {
        self.direction.is_some()
    }
}

/// The part of a texel's edge that the source sees.
#[derive(Clone, Default)]
pub(crate) struct Edge {
    points: Polygon,
    /// Some of the edge is not seen.
    broken: bool,
}

/// A texel or a part of one: its corners and edges.
pub(crate) struct Quad<'a> {
    /// Upper left, upper right, lower left, lower right.
    pub corners: [Sample; 4],
    /// Top and bottom (left to right), left and right (top to bottom).
    pub edges: [&'a Edge; 4],
}

/// Traces outlines of `destination` in `source`.
pub(crate) struct Tracer<'a> {
    pub destination: &'a Raster,
    pub source: &'a Raster,
}

impl Tracer<'_> {
    /// Looks a place of the destination up in the source.
    pub fn sample(&self, at: Vector2<f64>) -> Sample {
        let direction = self.destination.direction(RasterPx(at));
        let position = direction.and_then(|d| self.source.position(&d)).map(|p| p.0);
        Sample { at, direction, position }
    }

    /// The polyline from `a` to `b`, `b` being to the right of or below `a`.
    pub fn edge(&self, a: &Sample, b: &Sample) -> Edge {
        let mut edge = Edge::default();
        edge.points.extend(a.position);
        self.refine(a, b, 0, &mut edge);
        edge
    }

    fn refine(&self, a: &Sample, b: &Sample, depth: u32, edge: &mut Edge) {
        let middle = self.sample((a.at + b.at) / 2.0);
        let seen = [a, &middle, b].map(|sample| sample.position.is_some());
        let divide = match (a.position, middle.position, b.position) {
            (Some(p), Some(m), Some(q)) => self.is_bent(a, b, [p, m, q]),
            _ => seen != [false; 3],
        };
        if divide && depth < MAX_EDGE_DEPTH {
            self.refine(a, &middle, depth + 1, edge);
            self.refine(&middle, b, depth + 1, edge);
        } else {
            edge.broken |= seen != [true; 3];
            edge.points.extend(middle.position);
            edge.points.extend(b.position);
        }
    }

    fn is_bent(&self, a: &Sample, b: &Sample, [p, m, q]: [Vector2<f64>; 3]) -> bool {
        if angle_rad(a, b) > MAX_STEP_RAD {
            return true;
        }
        if self.source.is_whole_sphere() {
            let m = self.source.continued(m, p);
            let q = self.source.continued(q, m);
            return (m - (p + q) / 2.0).norm() > STRAIGHT_OVER_CREASES_PX;
        }
        // What lies beyond one side of the image is cut off, straight or not.
        let [width, height] = self.source.size_px().map(f64::from);
        let (low, high) = (p.inf(&m).inf(&q), p.sup(&m).sup(&q));
        let outside = high.x < 0.0 || high.y < 0.0 || low.x > width || low.y > height;
        !outside && (m - (p + q) / 2.0).norm() > STRAIGHT_PX
    }

    /// Calls `visit` with polygons that make up the seen part of `quad` (of about `quad_sr`), and whether each is
    /// whole. Returns whether anything of the outline was seen.
    pub fn trace(
        &self,
        quad: &Quad,
        quad_sr: f64,
        depth: u32,
        visit: &mut impl FnMut(&mut Polygon, bool),
    ) -> bool {
        let seen = quad.edges.iter().any(|edge| !edge.points.is_empty());
        let broken = quad.edges.iter().any(|edge| edge.broken);
        let [nw, ne, sw, se] = &quad.corners;
        let diagonal_rad = angle_rad(nw, se).max(angle_rad(ne, sw));
        let wide = diagonal_rad > MAX_DIAGONAL_RAD || quad_sr > MAX_TEXEL_SR;
        if wide && depth < MAX_WIDE_DEPTH {
            return self.divide(quad, quad_sr, depth, visit);
        }
        if !seen {
            return false;
        }
        let mut polygon = quad.outline();
        if broken && depth < MAX_BORDER_DEPTH && self.is_large(&polygon) {
            return self.divide(quad, quad_sr, depth, visit);
        }
        if self.source.is_whole_sphere() {
            polygon = self.follow_over_seams(&polygon);
        }
        visit(&mut polygon, !broken);
        true
    }

    fn is_large(&self, polygon: &[Vector2<f64>]) -> bool {
        let (low, high) = bounds(polygon);
        (high - low).max() > BORDER_PART_PX
    }

    /// Traces the four quarters of `quad`.
    fn divide(
        &self,
        quad: &Quad,
        quad_sr: f64,
        depth: u32,
        visit: &mut impl FnMut(&mut Polygon, bool),
    ) -> bool {
        let [nw, ne, sw, se] = quad.corners;
        let middle = |a: &Sample, b: &Sample| self.sample((a.at + b.at) / 2.0);
        let (n, s, w, e) = (middle(&nw, &ne), middle(&sw, &se), middle(&nw, &sw), middle(&ne, &se));
        let c = middle(&nw, &se);
        let mut seen = false;
        for corners in [[nw, n, w, c], [n, ne, c, e], [w, c, sw, s], [c, e, s, se]] {
            let [a, b, c, d] = &corners;
            let edges = [self.edge(a, b), self.edge(c, d), self.edge(a, c), self.edge(b, d)];
            seen |= self.trace(&Quad { corners, edges: edges.each_ref() }, quad_sr / 4.0, depth + 1, visit);
        }
        seen
    }

    /// The same outline as one connected polygon of the source's continued plane.
    ///
    /// Around a pole of a latitude-longitude map the outline does not close: the pole's edge of the map closes it.
    /// Around the middle of an edge of the octahedral map an outline ends at the half turn of its start, and the
    /// chord between the two runs through that middle: to close it straight is right.
    fn follow_over_seams(&self, outline: &[Vector2<f64>]) -> Polygon {
        let height = f64::from(self.source.size_px()[1]);
        let lat_long = matches!(self.source, Raster::LatLong(_));
        let at_pole = |p: &Vector2<f64>| lat_long && (p.y < 1e-6 || p.y > height - 1e-6);
        // A pole has no longitude of its own: it takes its neighbours'.
        let start = outline.iter().position(|p| !at_pole(p)).unwrap_or(0);
        let mut polygon = Polygon::with_capacity(outline.len() + 4);
        let Some(&first) = outline.get(start) else {
            return polygon;
        };
        polygon.push(first);
        let (mut last, mut pole) = (first, None);
        for p in outline.iter().cycle().skip(start + 1).take(outline.len()) {
            if at_pole(p) {
                polygon.extend(pole.is_none().then_some(Vector2::new(last.x, p.y)));
                pole = Some(p.y);
                continue;
            }
            let p = self.source.continued(*p, last);
            polygon.extend(pole.take().map(|y| Vector2::new(p.x, y)));
            polygon.push(p);
            last = p;
        }
        if lat_long && (last.x - first.x).abs() > 0.5 {
            let y = if first.y < height / 2.0 { 0.0 } else { height };
            polygon.extend([Vector2::new(last.x, y), Vector2::new(first.x, y)]);
        }
        polygon
    }
}

impl Quad<'_> {
    /// The edges joined, clockwise in the destination.
    fn outline(&self) -> Polygon {
        let [top, bottom, left, right] = self.edges;
        let along = top.points.iter().chain(&right.points);
        along.chain(bottom.points.iter().rev()).chain(left.points.iter().rev()).copied().collect()
    }
}

/// The angle between two places of the destination; 0 where one has no direction.
fn angle_rad(a: &Sample, b: &Sample) -> f64 {
    match (a.direction, b.direction) {
        (Some(a), Some(b)) => a.cross(&b).norm().atan2(a.dot(&b)),
        _ => 0.0,
    }
}

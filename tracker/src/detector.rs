//! Tags in an image: the AprilTag 3 library (Wang and Olson, *AprilTag 2: Efficient and robust fiducial detection*, IROS
//! 2016), behind an interface that other ways to find tags can share.

mod limits;
mod noise;
mod settings;

use std::cmp::Ordering;
use std::ptr::NonNull;

use apriltag_sys as c;
use coshade_lens::pixel::CameraPx;
use nalgebra::Vector2;

use crate::detection::{Detection, TagId};
use crate::family::Table;
use crate::luma::Luma;
use limits::Search;
pub use settings::{DetectorError, DetectorSettings};

/// What finds tags in images.
pub trait FindTags: Send {
    /// All tags in view by family and number; one that is there twice, twice.
    ///
    /// # Errors
    /// [`DetectorError::Image`] for one that is too large, [`DetectorError::Threads`] and [`DetectorError::Memory`] where the
    /// system has none.
    fn find(&mut self, image: &Luma) -> Result<Vec<Detection>, DetectorError>;

    /// Tags in view that can be found in an image `decimate` times smaller: faster, without the small ones.
    ///
    /// # Errors
    /// As [`find`](Self::find).
    fn find_coarsely(&mut self, image: &Luma, decimate: u32) -> Result<Vec<Detection>, DetectorError>;

    /// Tags within a part of the image, made `decimate` times smaller, in coordinates of the whole image. Where the part reaches
    /// beyond the image, it is cut.
    ///
    /// # Errors
    /// As [`find`](Self::find).
    fn find_in(
        &mut self,
        image: &Luma,
        region: Region,
        decimate: u32,
    ) -> Result<Vec<Detection>, DetectorError> {
        let Region { x_px, y_px, width_px, height_px } = region;
        let Some(part) = image.crop(x_px, y_px, width_px, height_px) else { return Ok(Vec::new()) };
        let mut found = self.find_coarsely(&part, decimate)?;
        let shift = Vector2::new(f64::from(x_px), f64::from(y_px));
        found.iter_mut().flat_map(|detection| &mut detection.corners_px).for_each(|corner| *corner += shift);
        Ok(found)
    }
}

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// Its first column.
    pub x_px: u32,
    /// Its first row.
    pub y_px: u32,
    /// Columns.
    pub width_px: u32,
    /// Rows.
    pub height_px: u32,
}

/// The AprilTag library's detector.
pub struct Detector {
    library: Library,
    families: Vec<Family>,
    settings: DetectorSettings,
    /// What the library may write to: it blurs an image that it does not make smaller in place.
    copy: Vec<u8>,
}

struct Family {
    family: crate::Family,
    table: Table,
}

/// The library's detector; freed on drop, before the tables that it knows.
struct Library(NonNull<c::apriltag_detector_t>);

// SAFETY: the detector and its tables are known to one owner only, and the library keeps nothing per thread.
unsafe impl Send for Library {}
// SAFETY: as above; tables are read only.
unsafe impl Send for Family {}

impl Detector {
    /// A detector.
    ///
    /// # Errors
    /// [`DetectorError`] for settings out of range, or without memory.
    pub fn new(settings: &DetectorSettings) -> Result<Self, DetectorError> {
        settings.check()?;
        // SAFETY: takes nothing, returns null or a detector that nobody else knows.
        let library = NonNull::new(unsafe { c::apriltag_detector_create() }).ok_or(DetectorError::Memory)?;
        let mut detector = Self {
            library: Library(library),
            families: Vec::new(),
            settings: settings.clone(),
            copy: Vec::new(),
        };
        for family in &settings.families {
            let table = Table::new(*family).ok_or(DetectorError::Memory)?;
            settings.check_table(*family, table.get().nbits)?;
            // SAFETY: detector and table are alive, and the table outlives the detector; no other detector knows it.
            unsafe {
                c::apriltag_detector_add_family_bits(
                    detector.library.0.as_ptr(),
                    table.pointer(),
                    settings.max_hamming as i32,
                );
            }
            let ready = !table.get().impl_.is_null();
            detector.families.push(Family { family: *family, table });
            if !ready {
                return Err(DetectorError::Memory);
            }
        }
        detector.configure();
        Ok(detector)
    }

    /// What it was made with.
    pub fn settings(&self) -> &DetectorSettings {
        &self.settings
    }

    fn configure(&mut self) {
        let settings = &self.settings;
        // SAFETY: alive, and nobody else knows it.
        let library = unsafe { self.library.0.as_mut() };
        library.quad_decimate = settings.decimate;
        library.refine_edges = settings.refine_edges;
        library.decode_sharpening = settings.decode_sharpening;
        library.qtp.min_cluster_pixels = settings.min_cluster_pixels as i32;
    }

    /// Gets ready for an image; false if it is too small for tags.
    fn prepare(&mut self, image: &Luma) -> Result<bool, DetectorError> {
        let Some(search) = Search::new(&self.settings, image)? else { return Ok(false) };
        // What has more contrast than noise alone is searched. The library looks at the range of 144 pixels, which for normal
        // noise is 5.3 ± 0.7 standard deviations.
        let above_noise = || (6.3 * noise::noise(image)).clamp(5.0, 40.0) as u32;
        let diff = self.settings.min_white_black_diff.unwrap_or_else(above_noise);
        // SAFETY: alive, and nobody else knows it.
        let library = unsafe { self.library.0.as_mut() };
        library.nthreads = search.threads as i32;
        library.quad_sigma = search.blur_px;
        library.qtp.min_white_black_diff = diff as i32;
        Ok(true)
    }

    /// Whether the library started the threads it was asked for. If it did not, it returned no tags.
    fn check_threads(&mut self) -> Result<(), DetectorError> {
        // SAFETY: alive, and nobody else knows it.
        let library = unsafe { self.library.0.as_mut() };
        match library.wp.is_null() {
            true => Err(DetectorError::Threads { threads: library.nthreads.unsigned_abs() }),
            false => Ok(()),
        }
    }

    /// Whether the library writes to the image that it is given.
    fn writes(&self) -> bool {
        self.settings.blur_px != 0.0 && self.settings.decimate <= 1.0
    }

    /// How far the library's corners are off to the lower right. A whole `decimate` takes the first pixel of each square for
    /// the square, whose middle is elsewhere; refined edges have been moved to where they are.
    fn offset_px(&self) -> f64 {
        match self.settings.refine_edges || self.settings.decimate == 1.5 {
            true => 0.0,
            false => (f64::from(self.settings.decimate) - 1.0) / 2.0,
        }
    }

    fn family_of(&self, pointer: *const c::apriltag_family_t) -> Option<crate::Family> {
        let known = self.families.iter().find(|known| known.table.pointer().cast_const() == pointer);
        known.map(|known| known.family)
    }

    fn detection(&self, found: &c::apriltag_detection_t) -> Option<Detection> {
        let tag = TagId { family: self.family_of(found.family)?, id: u32::try_from(found.id).ok()? };
        // In the library's order: lower left, lower right, upper right, upper left.
        let offset = self.offset_px();
        let corners_px = found.p.map(|[x, y]| CameraPx::from_apriltag(x - offset, y - offset).0);
        let finite = corners_px.iter().flatten().all(|coordinate| coordinate.is_finite());
        let hamming = u32::try_from(found.hamming).ok()?;
        finite.then_some(Detection { tag, corners_px, hamming, margin: found.decision_margin })
    }
}

impl FindTags for Detector {
    fn find_coarsely(&mut self, image: &Luma, decimate: u32) -> Result<Vec<Detection>, DetectorError> {
        let own = self.settings.decimate;
        self.settings.decimate = own.max(decimate.clamp(1, 16) as f32);
        self.configure();
        let found = self.find(image);
        self.settings.decimate = own;
        self.configure();
        found
    }

    fn find(&mut self, image: &Luma) -> Result<Vec<Detection>, DetectorError> {
        if !self.prepare(image)? {
            return Ok(Vec::new());
        }
        let (width_px, height_px) = (image.width_px(), image.height_px());
        // A part of an image is copied as well: the library's own images have rows as long as the given one's.
        let copied = self.writes() || image.stride_bytes() > 2 * width_px;
        let (bytes, stride) = if copied {
            self.copy.clear();
            (0..height_px).for_each(|y| self.copy.extend_from_slice(image.row(y)));
            (self.copy.as_ptr(), width_px)
        } else {
            (image.bytes().as_ptr(), image.stride_bytes())
        };
        let mut given = c::image_u8 {
            width: width_px as i32,
            height: height_px as i32,
            stride: stride as i32,
            buf: bytes.cast_mut(),
        };
        // SAFETY: `given` describes bytes that live until the call returns (`Luma` has checked their number) and that the
        // library only reads, but for a blur in place, for which they are a copy that is ours. What is returned is ours.
        let list = unsafe { c::apriltag_detector_detect(self.library.0.as_ptr(), &raw mut given) };
        let Some(list) = NonNull::new(list) else { return Err(DetectorError::Memory) };
        // SAFETY: the list is alive and holds `size` pointers to detections, one after the other.
        let mut found: Vec<Detection> = unsafe {
            let zarray = list.as_ref();
            let count = usize::try_from(zarray.size).unwrap_or(0);
            let pointers = zarray.data.cast::<*const c::apriltag_detection_t>();
            let pointers = if count > 0 { std::slice::from_raw_parts(pointers, count) } else { &[] };
            pointers.iter().filter_map(|pointer| self.detection(pointer.as_ref()?)).collect()
        };
        // SAFETY: made by the library for us, and not used any more.
        unsafe { c::apriltag_detections_destroy(list.as_ptr()) };
        self.check_threads()?;
        // Several threads find them in any order.
        found.sort_by(|a, b| a.tag.cmp(&b.tag).then_with(|| by_place(a, b)));
        Ok(found)
    }
}

fn by_place(a: &Detection, b: &Detection) -> Ordering {
    let [[a, ..], [b, ..]] = [a.corners_px, b.corners_px];
    a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y))
}

impl std::fmt::Debug for Detector {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Detector").field("settings", &self.settings).finish_non_exhaustive()
    }
}

impl Drop for Library {
    fn drop(&mut self) {
        // SAFETY: made by the library, freed once. The tables of families are still alive: they are fields behind this one.
        unsafe { c::apriltag_detector_destroy(self.0.as_ptr()) };
    }
}

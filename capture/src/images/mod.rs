//! Image files as a camera: `images:PATH?option=value&…`.
//!
//! PATH is a file, a folder or a glob pattern; files are taken in natural order (`2.png` before `10.png`). PNG (8 and 16
//! bit), JPEG, PGM, PPM, EXR and Radiance HDR are recognised by content. JPEG files become MJPG frames, undecoded; 16 bit grey becomes Y16,
//! or Z16 depth if the unit is given; colour becomes RGB24 (16 bit colour rounded to 8, alpha left out). Colour profiles
//! and the orientation that phones note are ignored: pixels are the sensor's.
//!
//! EXR and HDR become RGBF32: linear light, 1 = code white, exactly as in the file (R G B, or Y three times; alpha left
//! out). Such a camera has a linear response. Unlike the others they are decoded to memory of their own for each frame,
//! all layers of a file together.
//!
//! | option | meaning |
//! | --- | --- |
//! | `fps=30` | frames a second; stamps are multiples of 1/fps from 0 |
//! | `pace=realtime` | or `fast`: as fast as frames are asked for, with the same stamps |
//! | `loop=false` | `true`: begin again after the last file, stamps go on |
//! | `as=native` | `grey` or `rgb`: decode to 8 bit luminance or R′G′B′ |
//! | `layer=real` | this layer of EXR files; without it the only one, or the one without a name |
//! | `depth_unit_m=0.001` | the files are depth, this many metres a count |
//! | `depth_invalid=65535` | a code that means "no measurement" beside 0 |
//! | `layout=files` | `tum`: PATH is a folder with `rgb.txt` and `depth.txt`; stamps are the files' |
//! | `stream=rgb` | `depth`: which of the two; its unit is 1/5000 m unless given |
//! | `associate_s=0.02` | only images that have a partner in the other stream within this time |

mod camera;
mod describe;
mod files;
mod linear;
mod natural;
mod options;
mod pnm;
mod read;
pub mod tum;

use crate::camera::{Camera, CaptureError};
pub use camera::ImagesCamera;
pub use describe::{
    DepthSummary, DescribeError, Description, FolderLayout, Series, UnitSource, describe, describe_file,
};
pub(crate) use options::did_you_mean;
pub use options::{Deliver, ImagesOptions, Layout, Pace, TumStream};

/// Opens what follows `images:` in a source's name.
///
/// # Errors
/// [`CaptureError::Lost`] that says which file or option is wrong.
pub fn open(rest: &str) -> Result<Box<dyn Camera>, CaptureError> {
    let name = format!("images:{rest}");
    let options = ImagesOptions::parse(rest)
        .map_err(|reason| CaptureError::Lost { source_name: name.clone(), reason })?;
    Ok(Box::new(ImagesCamera::open(&name, &options)?))
}

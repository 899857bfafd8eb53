//! Reads ROS 1 bags of version 2.0 (<http://wiki.ros.org/Bags/Format/2.0>), the format of RealSense recordings.
//!
//! Chunks may be uncompressed, lz4 or bz2. A bag that was not closed is read by a scan. Own code instead of the
//! `rosbag` crate, which maps the file into memory and panics or allocates GiB where a length in it is wrong.

mod file;
mod record;

pub(crate) use file::BagFile;
pub(crate) use record::MAGIC;

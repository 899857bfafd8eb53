//! The graphics adapters of this machine, and whether they can do the work.

use serde::Serialize;
use wgpu::{Backends, DeviceType, Features, Instance, InstanceDescriptor};

/// An adapter that wgpu can open through Vulkan.
#[derive(Clone, Debug, Serialize)]
pub struct AdapterReport {
    /// Name by its driver.
    pub name: String,
    /// Driver and its version.
    pub driver: String,
    /// `discrete`, `integrated`, `virtual`, `software` or `other`.
    pub kind: &'static str,
    /// Whether it runs on the processor (Mesa's lavapipe, say): right pictures, low rates.
    pub software: bool,
    /// Whether passes can be timed by the adapter itself.
    pub timestamps: bool,
    /// Whether 32-bit float textures can be sampled with linear filtering.
    pub float32_filterable: bool,
    /// Largest side of a 2D texture in texels.
    pub max_texture_px: u32,
    /// Why a device with the adapter's own limits could not be opened; `None` if it could.
    pub device_error: Option<String>,
}

/// Lists the adapters and tries to open each. Empty if there is no Vulkan driver.
pub fn list() -> Vec<AdapterReport> {
    let mut descriptor = InstanceDescriptor::new_without_display_handle();
    descriptor.backends = Backends::VULKAN;
    let instance = Instance::new(descriptor);
    let adapters = pollster::block_on(instance.enumerate_adapters(Backends::VULKAN));
    adapters.iter().map(report).collect()
}

fn report(adapter: &wgpu::Adapter) -> AdapterReport {
    let info = adapter.get_info();
    let features = adapter.features();
    let limits = adapter.limits();
    let device = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        label: Some("probe"),
        required_limits: limits.clone(),
        ..Default::default()
    }));
    AdapterReport {
        name: info.name,
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
        kind: match info.device_type {
            DeviceType::DiscreteGpu => "discrete",
            DeviceType::IntegratedGpu => "integrated",
            DeviceType::VirtualGpu => "virtual",
            DeviceType::Cpu => "software",
            DeviceType::Other => "other",
        },
        software: info.device_type == DeviceType::Cpu,
        timestamps: features.contains(Features::TIMESTAMP_QUERY),
        float32_filterable: features.contains(Features::FLOAT32_FILTERABLE),
        max_texture_px: limits.max_texture_dimension_2d,
        device_error: device.err().map(|error| error.to_string()),
    }
}

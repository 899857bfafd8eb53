//! `coshade doctor`: does this machine have what a session needs, and what to do if not.

use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;

use coshade_render::adapter::{self, AdapterReport};
use serde::Serialize;

use super::print;

/// Check this machine: graphics adapter, drivers, camera permissions, packages. Says the cure for each problem.
///
/// Exit code 1 if something is missing that `coshade` cannot do without.
#[derive(clap::Args)]
pub struct Args {
    /// Print one JSON object: `checks`, each with `name`, `status` (ok, warning, error), `found` and `cure`; and
    /// `adapters`
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
enum Status {
    Ok,
    Warning,
    Error,
}

#[derive(Debug, Serialize)]
struct Check {
    name: &'static str,
    status: Status,
    found: String,
    cure: Option<String>,
}

impl Check {
    fn ok(name: &'static str, found: impl Into<String>) -> Self {
        Self { name, status: Status::Ok, found: found.into(), cure: None }
    }

    fn bad(name: &'static str, status: Status, found: impl Into<String>, cure: impl Into<String>) -> Self {
        Self { name, status, found: found.into(), cure: Some(cure.into()) }
    }
}

#[derive(Serialize)]
struct Report {
    checks: Vec<Check>,
    adapters: Vec<AdapterReport>,
}

/// Runs the checks and prints them.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let loader = vulkan_loader();
    let adapters = if loader.status == Status::Ok { adapter::list() } else { Vec::new() };
    let mut checks = vec![loader, vulkan_driver(), graphics_adapter(&adapters)];
    checks.extend(video_devices(Path::new("/dev")));
    checks.push(runtime_folder());
    checks.push(processor());
    let report = Report { checks, adapters };
    if args.json {
        print::json(&report)?;
    } else {
        print::text(&table(&report.checks))?;
    }
    let failed = report.checks.iter().any(|check| check.status == Status::Error);
    Ok(if failed { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

fn table(checks: &[Check]) -> String {
    let mut out = String::new();
    for check in checks {
        let mark = match check.status {
            Status::Ok => "ok     ",
            Status::Warning => "warning",
            Status::Error => "ERROR  ",
        };
        let _ = writeln!(out, "{mark}  {:<18} {}", check.name, check.found);
        if let Some(cure) = &check.cure {
            let _ = writeln!(out, "         {:<18} → {cure}", "");
        }
    }
    out
}

const INSTALL_VULKAN: &str =
    "sudo apt-get install libvulkan1 mesa-vulkan-drivers (or your GPU maker's driver)";

fn vulkan_loader() -> Check {
    const NAME: &str = "Vulkan loader";
    let library =
        library_folders().into_iter().map(|dir| dir.join("libvulkan.so.1")).find(|file| file.exists());
    match library {
        Some(file) => Check::ok(NAME, file.display().to_string()),
        None => Check::bad(NAME, Status::Error, "libvulkan.so.1 not found", INSTALL_VULKAN),
    }
}

/// The folders of the dynamic loader that a distribution puts `libvulkan.so.1` in, `LD_LIBRARY_PATH` first.
fn library_folders() -> Vec<std::path::PathBuf> {
    let user = std::env::var_os("LD_LIBRARY_PATH").unwrap_or_default();
    let machine = format!("/usr/lib/{}-linux-gnu", std::env::consts::ARCH);
    let system = [machine.as_str(), "/usr/lib64", "/usr/lib", "/usr/local/lib"];
    std::env::split_paths(&user).chain(system.iter().map(Into::into)).collect()
}

fn vulkan_driver() -> Check {
    const NAME: &str = "Vulkan drivers";
    for variable in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"] {
        if let Some(files) = std::env::var_os(variable) {
            return Check::ok(NAME, format!("{variable}={}", files.display()));
        }
    }
    let folders = ["/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d", "/usr/local/share/vulkan/icd.d"];
    let mut names: Vec<String> = folders
        .iter()
        .filter_map(|dir| std::fs::read_dir(dir).ok())
        .flatten()
        .filter_map(|entry| Some(entry.ok()?.file_name().to_string_lossy().into_owned()))
        .filter(|name| name.ends_with(".json"))
        .collect();
    names.sort();
    if names.is_empty() {
        return Check::bad(
            NAME,
            Status::Error,
            format!("no driver in {}", folders.join(", ")),
            INSTALL_VULKAN,
        );
    }
    Check::ok(NAME, names.join(", "))
}

fn graphics_adapter(adapters: &[AdapterReport]) -> Check {
    const NAME: &str = "graphics adapter";
    let usable = |adapter: &&AdapterReport| adapter.device_error.is_none();
    let Some(best) = adapters.iter().filter(usable).min_by_key(|adapter| adapter.software) else {
        let reasons: Vec<_> = adapters
            .iter()
            .filter_map(|adapter| Some(format!("{}: {}", adapter.name, adapter.device_error.as_ref()?)))
            .collect();
        let found = if reasons.is_empty() { "none".to_owned() } else { reasons.join("; ") };
        return Check::bad(NAME, Status::Error, found, INSTALL_VULKAN);
    };
    let found = format!("{} ({}, {})", best.name, best.kind, best.driver);
    if best.software {
        let cure = "pictures are right but slow; install the Vulkan driver of your GPU for live rates";
        return Check::bad(NAME, Status::Warning, found, cure);
    }
    Check::ok(NAME, found)
}

/// One check a video device, or a single warning if there is none.
fn video_devices(dev: &Path) -> Vec<Check> {
    const NAME: &str = "cameras";
    let mut devices: Vec<_> = std::fs::read_dir(dev)
        .into_iter()
        .flatten()
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            name.strip_prefix("video").is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()))
        })
        .collect();
    devices.sort();
    if devices.is_empty() {
        let cure = "plug one in, or use images:, replay: sources";
        return vec![Check::bad(NAME, Status::Warning, format!("no {}/video*", dev.display()), cure)];
    }
    devices
        .iter()
        .map(|device| match std::fs::OpenOptions::new().read(true).write(true).open(device) {
            Ok(_) => Check::ok(NAME, format!("{} can be opened", device.display())),
            Err(error) => {
                let cure = match error.kind() {
                    std::io::ErrorKind::PermissionDenied => "sudo usermod -aG video $USER, then log in again",
                    _ => "unplug and replug the camera; is another program using it?",
                };
                Check::bad(NAME, Status::Warning, format!("{}: {error}", device.display()), cure)
            }
        })
        .collect()
}

/// Vulkan drivers and windows keep their sockets there, and complain on standard error where it is missing.
fn runtime_folder() -> Check {
    const NAME: &str = "runtime folder";
    const CURE: &str =
        "export XDG_RUNTIME_DIR=/run/user/$(id -u), or any folder of yours that only you can read";
    match std::env::var_os("XDG_RUNTIME_DIR") {
        Some(folder) if Path::new(&folder).is_dir() => Check::ok(NAME, folder.display().to_string()),
        Some(folder) => Check::bad(NAME, Status::Warning, format!("{} is no folder", folder.display()), CURE),
        None => Check::bad(NAME, Status::Warning, "XDG_RUNTIME_DIR is not set", CURE),
    }
}

fn processor() -> Check {
    const NAME: &str = "processor";
    match std::thread::available_parallelism() {
        Ok(threads) => Check::ok(NAME, format!("{threads} threads")),
        Err(error) => {
            Check::bad(NAME, Status::Warning, error.to_string(), "number of threads unknown, using 1")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_numbered_video_devices_count_as_cameras() {
        let dev = tempfile::tempdir().unwrap();
        for name in ["video0", "video12", "video", "videoX", "media0"] {
            std::fs::write(dev.path().join(name), "").unwrap();
        }
        let found: Vec<_> = video_devices(dev.path()).into_iter().map(|check| check.found).collect();
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].contains("video0") && found[1].contains("video12"), "{found:?}");
    }

    #[test]
    fn no_adapter_is_an_error_with_a_cure() {
        let check = graphics_adapter(&[]);
        assert_eq!(check.status, Status::Error);
        assert!(check.cure.unwrap().contains("mesa-vulkan-drivers"));
    }

    #[test]
    fn a_real_adapter_is_preferred_to_a_software_one() {
        let adapter = |name: &str, software| AdapterReport {
            name: name.to_owned(),
            driver: String::new(),
            kind: if software { "software" } else { "discrete" },
            software,
            timestamps: true,
            float32_filterable: true,
            max_texture_px: 16384,
            device_error: None,
        };
        let check = graphics_adapter(&[adapter("llvmpipe", true), adapter("card", false)]);
        assert_eq!((check.status, check.found.starts_with("card")), (Status::Ok, true));
        assert_eq!(graphics_adapter(&[adapter("llvmpipe", true)]).status, Status::Warning);
    }
}

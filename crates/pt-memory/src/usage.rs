//! Memory used by the process, and memory available on the system.

use std::path::Path;

/// Peak physical memory of the process so far, in bytes; `None` if the system does not report it.
pub fn peak_bytes() -> Option<u64> {
    own("VmHWM:")
}

/// Physical memory currently used by the process, in bytes; `None` if the system does not report
/// it.
pub fn used_bytes() -> Option<u64> {
    own("VmRSS:")
}

fn own(field: &str) -> Option<u64> {
    kib(&std::fs::read_to_string("/proc/self/status").ok()?, field)
}

/// Parses the number after `field` in a text with one field per line; returns bytes.
fn kib(text: &str, field: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(field))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024)
}

/// Memory that the process may still allocate, in bytes: limited by the machine and by control
/// groups; `None` if the system does not report it.
pub fn available_bytes() -> Option<u64> {
    let machine = kib(&std::fs::read_to_string("/proc/meminfo").ok()?, "MemAvailable:")?;
    let groups = std::fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let left = left_by_groups(Path::new("/sys/fs/cgroup"), &groups);
    Some(left.map_or(machine, |left| machine.min(left)))
}

/// Memory left by the control groups in `groups`, whose folders are below `root`; `None` if they do
/// not limit it.
///
/// Lines are `number:controllers:path`; in version 2 there are no controllers. A group is also
/// limited by its ancestors. [cgroups(7)]
fn left_by_groups(root: &Path, groups: &str) -> Option<u64> {
    let left_of = |line: &str| {
        let mut parts = line.splitn(3, ':').skip(1);
        let (controllers, path) = (parts.next()?, parts.next()?.trim_start_matches('/'));
        let (root, limit, usage) = match controllers {
            "" => (root.to_owned(), "memory.max", "memory.current"),
            "memory" => (root.join("memory"), "memory.limit_in_bytes", "memory.usage_in_bytes"),
            _ => return None,
        };
        let group = root.join(path);
        let above = group.ancestors().take_while(|folder| folder.starts_with(&root));
        above
            .filter_map(|folder| {
                let number = |name| -> Option<u64> {
                    std::fs::read_to_string(folder.join(name)).ok()?.trim().parse().ok()
                };
                Some(number(limit)?.saturating_sub(number(usage)?))
            })
            .min()
    };
    groups.lines().filter_map(left_of).min()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    #[cfg(target_os = "linux")]
    fn the_system_reports_what_is_held_and_what_is_left() {
        for bytes in [peak_bytes(), used_bytes(), available_bytes()] {
            assert!(bytes.is_some_and(|bytes| bytes > 1 << 16), "{bytes:?}");
        }
    }

    #[test]
    fn control_groups_leave_what_the_tightest_one_leaves() {
        let folder = tempfile::tempdir().expect("a folder");
        let root = folder.path();
        let group = |path: &str, files: [(&str, &str); 2]| {
            fs::create_dir_all(root.join(path)).expect("there is room");
            for (name, content) in files {
                fs::write(root.join(path).join(name), content).expect("there is room");
            }
        };
        let second = |max, current| [("memory.max", max), ("memory.current", current)];
        let first =
            |max, current| [("memory.limit_in_bytes", max), ("memory.usage_in_bytes", current)];
        group("a/b", second("max\n", "10\n"));
        group("a", second("1000\n", "400\n"));
        group("memory/c", first("900\n", "500\n"));
        let left = |groups| left_by_groups(root, groups);
        assert_eq!(left("0::/a/b\n"), Some(600));
        assert_eq!(left("5:devices:/\n4:memory:/c\n0::/a/b\n"), Some(400));
        assert_eq!(left("0::/\n"), None);
        assert_eq!(left("4:cpu:/c\n"), None);
        assert_eq!(left("nonsense"), None);
    }
}

//! Full and read-only disks: no wrong image, no lost film.

#![cfg(target_os = "linux")]

use std::process::Command;

use crate::common::{Folder, SCENE};

const RENDER: &str =
    "-q -r 60 45 -s 200 -m 5 -t 1 --receipt stable --checkpoint-every 0.01 -f out.exr";

/// Runs a script in which `disk SIZE` mounts a small disk at the folder `disk`. Returns its output,
/// or `None` if mounting is not permitted.
fn on_a_disk(folder: &Folder, script: &str) -> Option<String> {
    let program = env!("CARGO_BIN_EXE_pathtracer");
    let script = format!(
        "set -u\nrender() {{ {program} {RENDER} \"$@\" {SCENE}; }}\n\
         resume() {{ {program} resume -q out.exr; }}\n\
         disk() {{ mkdir -p disk && mount -t tmpfs -o size=$1 none disk && cd disk || exit 77; }}\n{script}"
    );
    let mut command = Command::new("unshare");
    command.args(["--map-root-user", "--mount", "sh", "-c", &script]).current_dir(folder.path(""));
    let output = command.output().ok().filter(|output| output.status.code() == Some(0));
    output.map(|output| String::from_utf8(output.stdout).expect("UTF-8"))
}

fn may_make_disks() -> bool {
    let may = on_a_disk(&Folder::new(), "disk 1m").is_some();
    if !may {
        println!("skipped: small disks cannot be mounted here (unshare --map-root-user --mount)");
    }
    may
}

/// Returns a folder with the expected image.
fn wanted() -> Folder {
    let folder = Folder::new();
    folder.succeed(&format!("{RENDER} SCENE"));
    folder
}

/// The disk has room for nothing, for part of a film, for one film but not for the next, and so on.
/// Then there is enough room again.
#[test]
fn a_disk_that_is_full_spoils_nothing() {
    if !may_make_disks() {
        return;
    }
    let folder = wanted();
    let mut statuses = Vec::new();
    for kilobytes in [0, 4, 40, 180, 220, 260, 300, 420, 460, 640, 900] {
        let script = format!(
            "disk 2m\nrender & sleep 0.15; kill -INT $!; wait $!\n\
             films() {{ {} info out.exr.film > ../reported 2>&1; }}\n\
             [ -e out.exr.film ] && films && before=1 || before=0\n\
             free=$(df -k . | awk 'NR == 2 {{print $4}}')\n\
             [ $free -gt {kilobytes} ] && head -c $((1024 * (free - {kilobytes}))) /dev/zero > filler\n\
             rm -f out.exr; render 2> ../said; status=$?\n\
             [ $before = 1 ] && {{ films || echo lost; }}\n\
             [ -e out.exr ] && {{ cmp out.exr ../out.exr || echo wrong; }}\n\
             rm -f filler; resume 2>> ../said || echo failed; cmp out.exr ../out.exr || echo wrong\n\
             echo status $status",
            env!("CARGO_BIN_EXE_pathtracer")
        );
        let reported = on_a_disk(&folder, &script).expect("disks can be made");
        let said = folder.read("said");
        let said = String::from_utf8_lossy(&said);
        let status = reported.trim().strip_prefix("status ");
        let status = status.unwrap_or_else(|| panic!("{kilobytes} KiB: {reported}; {said}"));
        assert!(["0", "2"].contains(&status), "{kilobytes} KiB: {reported}; {said}");
        assert!(
            status == "0"
                || said.contains("cannot be written")
                || said.contains("cannot create a file"),
            "{said}"
        );
        statuses.push(status.to_owned());
    }
    assert!(statuses.contains(&"2".into()), "no disk was full: {statuses:?}");
    assert!(statuses.contains(&"0".into()), "all disks were full: {statuses:?}");
}

/// A disk that becomes read-only between a render and its continuation.
#[test]
fn a_disk_that_takes_nothing_loses_no_film() {
    if !may_make_disks() {
        return;
    }
    let folder = wanted();
    let script = "disk 4m\nrender & sleep 0.15; kill -INT $!; wait $!\n\
         cp out.exr.film ../kept.film; rm -f out.exr\n\
         mount -o remount,ro . ; render 2> ../said; echo $?\n\
         cmp out.exr.film ../kept.film && echo kept\n\
         mount -o remount,rw . ; resume && cmp out.exr ../out.exr && echo same";
    let reported = on_a_disk(&folder, script).expect("disks can be made");
    assert_eq!(reported, "2\nkept\nsame\n", "{}", String::from_utf8_lossy(&folder.read("said")));
}

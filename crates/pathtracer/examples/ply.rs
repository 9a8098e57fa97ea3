//! Loads a PLY file, shoots rays at it from the front, and prints the hits as characters.

use pt_bvh::{BuildOptions, Bvh, Geometry, Hit};
use pt_math::{Ray, Vec3};

fn main() {
    let path = std::env::args().nth(1).ok_or("usage: ply MESH.ply".into());
    if let Err(error) = path.and_then(|path| shoot(path.as_ref())) {
        eprintln!("ply: {error}");
        std::process::exit(2);
    }
}

fn shoot(path: &std::path::Path) -> Result<(), Box<dyn std::error::Error>> {
    let scene = pt_formats::load(path)?;
    let Some(pt_scene::Geometry::Mesh(mesh)) = scene.objects.first().map(|o| &o.geometry) else {
        return Err("expected a mesh".into());
    };
    let positions: Vec<_> = mesh.positions.iter().map(|&p| Vec3::from(p)).collect();
    let geometry = Geometry { positions: &positions, triangles: &mesh.triangles, spheres: &[] };
    let bvh = Bvh::build(geometry, &BuildOptions::default())?;

    // One ray for each character of 32 rows of 64, from a square in front of the mesh.
    let (center, side) = (bvh.bounds().center(), bvh.bounds().diagonal().max_element());
    let place = |x, y| center + side * Vec3::new(x as f32 / 64.0 - 0.5, 0.5 - y as f32 / 32.0, 1.0);
    let rays = (0..64 * 32).map(|i| Ray::new(place(i % 64, i / 64), Vec3::NEG_Z));
    let mut hits = Vec::new();
    bvh.intersect_batch(&rays.collect::<Vec<_>>(), &mut hits);

    // Hits have t from 0.5 to 1.5 sides: the nearer, the darker.
    let letter = |hit: Hit| char::from(b".:-=+*%#"[(7.99 * (1.5 - hit.t / side)) as usize]);
    for row in hits.chunks(64) {
        println!("{}", row.iter().map(|hit| hit.map_or(' ', letter)).collect::<String>());
    }
    Ok(())
}

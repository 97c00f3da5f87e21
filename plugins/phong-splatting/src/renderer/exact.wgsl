// The scene's lights, computed for each pixel as by `ewa-phong`.
#import surfelshop::surface::Surface
#import surfelshop::phong
#import phong_splats::settings

fn shade(s: Surface) -> vec4<f32> {
    let p = settings;
    let material = phong::Material(
        s.albedo, p.diffuse, vec3(p.specular), p.shininess, p.ambient, p.ao_strength, p.ao_affects,
    );
    return vec4(phong::lit(s, material), 1.0);
}

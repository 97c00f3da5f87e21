//! What columns are taken for.

use super::*;

/// Checks the columns of a table and what is said of them.
fn looks(text: &str, columns: &str, note: &str) -> CollectedCloud {
    let cloud = cloud(text);
    assert_eq!(shape(&cloud), columns, "{text}");
    assert_eq!(cloud.header.format, format!("text, {note}"), "{text}");
    // What the reader found is no comment of the file.
    let is_note = |comment: &String| comment.starts_with("columns ");
    assert!(!cloud.header.comments.iter().any(is_note), "{:?}", cloud.header.comments);
    cloud
}

#[test]
fn layouts_without_names_are_guessed_by_number_and_values() {
    let xyz = "position 3 f64";
    looks("1 2 3\n4 5 6\n", xyz, "columns x,y,z guessed; separated by spaces");
    looks("1.5,2,3\n4,5,6\n", xyz, "columns x,y,z guessed; separated by commas");
    looks("1.5, 2, 3\n4, 5, 6\n", xyz, "columns x,y,z guessed; separated by commas");
    looks("1\t2\t3\n4\t5\t6\n", xyz, "columns x,y,z guessed; separated by tabs");
    looks(
        "1 2 3 0.25\n4 5 6 17\n",
        "position 3 f64, intensity 1 f32",
        "columns x,y,z,intensity guessed; separated by spaces",
    );
    let colors = looks(
        "1 2 3 255 0 9\n4 5 6 1 2 3\n",
        "position 3 f64, color 3 u8",
        "columns x,y,z,r,g,b guessed; separated by spaces",
    );
    assert_eq!(column(&colors, "color").1, [255.0, 0.0, 9.0, 1.0, 2.0, 3.0]);
    looks(
        "1 2 3 65280 0 256\n4 5 6 1 2 3\n",
        "position 3 f64, color 3 u16",
        "columns x,y,z,r,g,b guessed; separated by spaces",
    );
    looks(
        "1 2 3 0.5 0.25 1.0\n4 5 6 0.0 0.1 0.1\n",
        "position 3 f64, color 3 f32",
        "columns x,y,z,r,g,b guessed; separated by spaces",
    );
    looks(
        "1 2 3 0.6 0.8 0\n4 5 6 0 0 -1\n7 8 9 0.36 0.48 0.8\n",
        "position 3 f64, normal 3 f32",
        "columns x,y,z,nx,ny,nz guessed; separated by spaces",
    );
    looks(
        "1 2 3 4.5 -7 0.1\n4 5 6 100.123456789 2 3\n",
        "position 3 f64, column_4 1 f64, column_5 1 f32, column_6 1 f32",
        "columns x,y,z,column_4,column_5,column_6 guessed; separated by spaces",
    );
    looks(
        "1 2 3 -15 255 0 9\n4 5 6 2047 1 2 3\n",
        "position 3 f64, intensity 1 f32, color 3 u8",
        "columns x,y,z,intensity,r,g,b guessed; separated by spaces",
    );
    looks(
        "1 2 3 10 20 30 255\n4 5 6 12 22 32 255\n",
        "position 3 f64, color 4 u8",
        "columns x,y,z,r,g,b,a guessed; separated by spaces",
    );
}

#[test]
fn long_layouts_without_names_are_guessed() {
    let all = "position 3 f64, color 3 u8, normal 3 f32";
    let note = "columns x,y,z,r,g,b,nx,ny,nz guessed; separated by spaces";
    looks("1 2 3 255 0 9 0 0 1\n4 5 6 1 2 3 0.6 0.8 0\n", all, note);
    looks(
        "1 2 3 0 0 1 77 255 0 9\n4 5 6 0.6 0.8 0 5 1 2 3\n",
        "position 3 f64, normal 3 f32, intensity 1 f32, color 3 u8",
        "columns x,y,z,nx,ny,nz,intensity,r,g,b guessed; separated by spaces",
    );
    looks(
        "1 2 3 0.5 10 20 30 -4 a\n4 5 6 0.5 10 20 31 -4 b\n",
        "position 3 f64, intensity 1 f32, color 3 u8, column_8 1 f32",
        "columns x,y,z,intensity,r,g,b,column_8,- guessed; separated by spaces",
    );
}

#[test]
fn names_in_a_header_say_what_columns_are() {
    let found = looks(
        "X,Y,Z,Reflectance,Red,Green,Blue,Class,Flow\n1,2,3,0.5,1,2,3,6,7\n4,5,6,0.5,1,2,300,6,7\n",
        "position 3 f64, intensity 1 f32, color 3 u16, classification 1 u8, Flow 1 f32",
        "columns x,y,z,intensity,r,g,b,classification,Flow by their names; separated by commas; one header line",
    );
    assert_eq!(found.columns[0], [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    looks(
        "gps_time;Easting [m];northing;Height (m);label\n305.25;1;2;3;4\n306;4;5;6;4\n",
        "gps_time 1 f64, position 3 f64, label 1 f32",
        "columns gps_time,x,y,z,label by their names; separated by semicolons; one header line",
    );
    looks(
        "//X Y Z R G B Nx Ny Nz\n3\n1 2 3 4 5 6 0 0 1\n1 2 3 4 5 6 0 0 1\n1 2 3 4 5 6 0 0 1\n",
        "position 3 f64, color 3 u8, normal 3 f32",
        "columns x,y,z,r,g,b,nx,ny,nz by their names; separated by spaces; one header line",
    );
    looks(
        "return_number number_of_returns scan_angle point_source z y x\n1 2 -3.5 40 1 2 3\n1 1 2 41 1 2 3\n",
        "return_number 1 u8, n_returns 1 u8, scan_angle 1 f32, point_source 1 u16, position 3 f64",
        "columns return_number,n_returns,scan_angle,point_source,z,y,x by their names; separated by spaces; one header line",
    );
}

#[test]
fn a_name_that_several_columns_claim_goes_to_the_clearest() {
    looks(
        "x,y,height,z,X\n1,2,9,3,7\n4,5,9,6,8\n",
        "position 3 f64, height 1 f32, X 1 f32",
        "columns x,y,height,z,X by their names; separated by commas; one header line",
    );
    // Columns of text are none of numbers, and what lacks them is no whole column.
    looks(
        "x,y,z,nx,ny,nz,red,green,blue\n1,2,3,0,0,1,a,5,6\n4,5,6,0,0,b,c,8,9\n4,5,6,0,0,b,c,8,9\n",
        "position 3 f64, nx 1 f32, ny 1 f32, green 1 f32, blue 1 f32",
        "columns x,y,z,nx,ny,-,-,green,blue by their names; separated by commas; one header line",
    );
    // Components without the others of their column, and a name that needs more of them.
    looks(
        "x,y,z,r,g,normal,Flow,flow,a.0,a.1\n1,2,3,4,5,6,7,8,9,9\n",
        "position 3 f64, r 1 f32, g 1 f32, normal_2 1 f32, Flow 1 f32, flow_2 1 f32, a 2 f32",
        "columns x,y,z,r,g,normal_2,Flow,flow_2,a.0,a.1 by their names; separated by commas; one header line",
    );
}

#[test]
fn types_follow_numbers_from_all_over_the_file() {
    let mut text = "x y z r g b class id\n".to_owned();
    for i in 0..40_000 {
        // What is larger comes behind the first thousand lines.
        let (red, class) = if i > 30_000 { (4000, 300) } else { (17, 3) };
        text += &format!("{i} 0.5 1 {red} 2 3 {class} {}\n", i * 100);
    }
    let found = cloud(&text);
    let expected = "position 3 f64, color 3 u16, classification 1 u16, id 1 f64";
    assert_eq!(shape(&found), expected);
    assert_eq!(column(&found, "classification").1[39_999], 300.0);
    assert_eq!(column(&found, "id").1[39_999], 3_999_900.0);
    assert_eq!(column(&found, POSITION).1.len(), 120_000);
}

#[test]
fn settings_override_what_is_guessed() {
    let read_set = |text: &str, columns: &str, delimiter, header_lines| {
        let columns = columns.to_owned();
        let set = Settings { columns, delimiter, header_lines, ..Settings::default() };
        read_with::<Xyz>(text.as_bytes(), "a.txt", &set)
    };
    use crate::xyz::Separator::{Auto, Comma, Semicolon};
    let found = read_set("1 2 3 4 5\n6 7 8 9 10\n", "z, y,x,-", Auto, -1).unwrap();
    assert_eq!(shape(&found.clouds[0]), "position 3 f64");
    assert_eq!(found.clouds[0].columns[0], [3.0, 2.0, 1.0, 8.0, 7.0, 6.0]);
    let note = "columns z,y,x,-,- as set; separated by spaces";
    assert_eq!(found.clouds[0].header.format, format!("text, {note}"));
    let found = read_set("a b c\n1 2 3\n4 5 6\n7 8 9\n", "", Auto, 2).unwrap();
    assert_eq!(found.clouds[0].columns[0], [4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
    let many = "no point\n".repeat(1000) + &"1 2 3\n".repeat(2000);
    let found = read_set(&many, "", Auto, 1000).unwrap();
    assert_eq!(found.clouds[0].columns[0].len(), 6000);
    let found = read_set("1 2 3 255\n", "x:f32,y,z,intensity:u16", Auto, -1).unwrap();
    assert_eq!(shape(&found.clouds[0]), "position 3 f32, intensity 1 u16");
    // 1,5 is two numbers where the comma separates, one where it does not.
    let found = read_set("1,5;2,5;3,5\n", "", Semicolon, -1).unwrap();
    assert_eq!(found.clouds[0].columns[0], [1.5, 2.5, 3.5]);
    assert!(refusal(read_set("1 2 3\n", "", Comma, -1)).contains("three numbers"));
    let line = refusal(read_set("1 2 3\n", "x,y,z,r", Auto, -1));
    assert!(line.starts_with("--text-columns: expected at most 3 names"), "{line}");
    let line = refusal(read_set("1 2 3\n", "x,y", Auto, -1));
    assert!(line.starts_with("--text-columns: expected x, y and z, found `x,y`; "), "{line}");
    let line = refusal(read_set("1 2 3 4\n", "x,y,z,w:q7", Auto, -1));
    let types = "i8, u8, i16, u16, i32, u32, f32, f64";
    let expected = format!("--text-columns: expected one of {types} behind `w:`, found `q7`; ");
    assert!(line.starts_with(&expected), "{line}");
    assert!(refusal(read_set("1 2 3\n", "x:u8,y,z", Auto, -1)).contains("x:f32"));
    let line = refusal(read("lon,lat,note\n1,2,3\n"));
    assert!(line.contains("`lon,lat,note`") && line.contains("--text-columns"), "{line}");
}

#[test]
fn columns_of_words_are_left_out_with_a_line() {
    let table = "x,y,z,class,intensity\n1,2,3,ground,5\n2,3,4,tree,6\n3,4,5,tree,7\n";
    let found = read(table).unwrap();
    assert_eq!(shape(&found.clouds[0]), "position 3 f64, intensity 1 f32");
    let line = "column 4 `class` is left out: expected numbers, found words such as `ground`; write a number for \
                each word to have it as classes";
    assert_eq!(found.warnings, [line]);
}

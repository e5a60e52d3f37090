//! The header is that of the code: a test compares, `just header` writes.

use std::path::Path;

/// The header that cbindgen makes of the sources, which it reads from `lib.rs` on: nothing is built, and no registry asked.
fn header() -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(root.join("cbindgen.toml")).unwrap();
    let builder = cbindgen::Builder::new().with_config(config).with_src(root.join("src/lib.rs"));
    let mut made = Vec::new();
    builder.generate().unwrap().write(&mut made);
    String::from_utf8(made).unwrap()
}

const HEADER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/include/tiltvp.h");

#[test]
fn the_header_is_that_of_the_code() {
    let kept = std::fs::read_to_string(HEADER).unwrap();
    assert!(kept == header(), "include/tiltvp.h is not that of the code: run `just header`");
}

#[test]
#[ignore = "writes the header: `just header`"]
fn write_the_header() {
    std::fs::write(HEADER, header()).unwrap();
}

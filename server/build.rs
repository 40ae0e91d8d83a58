//! Builds the server anew when the dashboard's bundle has changed, which it embeds.

fn main() {
    println!("cargo::rerun-if-changed=../web/dist");
}

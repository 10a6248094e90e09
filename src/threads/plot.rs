//! placeholder
use std::path::Path;
/// x
pub fn plot(_t: &super::ThreadTable, _p: &Path) -> crate::Result<()> {
    Ok(())
}

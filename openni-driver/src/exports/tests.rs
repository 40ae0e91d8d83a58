//! What C may get wrong in a call.

use super::*;

#[test]
fn a_property_is_given_only_where_there_is_room_for_it() {
    let asked = |room: c_int| {
        let (mut data, mut size) = ([0u8; 8], room);
        // SAFETY: there is room for 8 bytes, more than is ever claimed here.
        let status = unsafe { give(Some(vec![7; 4]), data.as_mut_ptr().cast(), &raw mut size) };
        (status, size, data)
    };
    for room in [-1, c_int::MIN, 0, 3] {
        assert_eq!(asked(room), (STATUS_BAD_PARAMETER, room, [0; 8]));
    }
    assert_eq!(asked(8), (STATUS_OK, 4, [7, 7, 7, 7, 0, 0, 0, 0]));
}

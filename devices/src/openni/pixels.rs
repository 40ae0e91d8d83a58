//! From the bytes of a depth frame to an image in millimetres.

use posefuse_skeleton::DepthImage;

/// How a frame's bytes lie.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    /// The whole image: pixels in a row, rows.
    pub(super) full: [u32; 2],
    /// What of it the bytes hold.
    pub(super) size: [u32; 2],
    /// Its first pixel and row within the whole.
    pub(super) origin: [u32; 2],
    /// From one row's beginning to the next one's.
    pub(super) row_bytes: usize,
    /// One step of a pixel, micrometres.
    pub(super) unit_um: u32,
    /// Rows run from right to left.
    pub(super) mirrored: bool,
}

/// The image; what the bytes do not hold stays empty.
pub(super) fn image(bytes: &[u8], layout: &Layout) -> DepthImage {
    let [width, height] = layout.full;
    let mut image = DepthImage::empty(width, height);
    let row_bytes = match layout.row_bytes {
        0 => layout.size[0] as usize * 2,
        row_bytes => row_bytes,
    };
    let first = layout.origin[0] as usize;
    let rows = image.millimetres.chunks_exact_mut(width.max(1) as usize);
    let rows = rows
        .skip(layout.origin[1] as usize)
        .take(layout.size[1] as usize);
    for (row, bytes) in rows.zip(bytes.chunks(row_bytes.max(1))) {
        let pixels = bytes.chunks_exact(2).take(layout.size[0] as usize);
        for (to, from) in row.iter_mut().skip(first).zip(pixels) {
            *to = millimetres(u16::from_ne_bytes([from[0], from[1]]), layout.unit_um);
        }
        if layout.mirrored {
            row.reverse();
        }
    }
    image
}

/// Rounded; what is nearer than a millimetre and yet something is a millimetre.
fn millimetres(value: u16, unit_um: u32) -> u16 {
    match unit_um {
        1000 => value,
        _ if value == 0 => 0,
        unit_um => ((u32::from(value) * unit_um + 500) / 1000).clamp(1, u32::from(u16::MAX)) as u16,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(pixels: &[u16]) -> Vec<u8> {
        pixels
            .iter()
            .flat_map(|pixel| pixel.to_ne_bytes())
            .collect()
    }

    const WHOLE: Layout = Layout {
        full: [3, 2],
        size: [3, 2],
        origin: [0, 0],
        row_bytes: 6,
        unit_um: 1000,
        mirrored: false,
    };

    #[test]
    fn mirroring_is_undone_rows_may_be_padded_and_units_are_told_apart() {
        let pixels = bytes(&[1, 2, 3, 4, 5, 6]);
        assert_eq!(image(&pixels, &WHOLE).millimetres, [1, 2, 3, 4, 5, 6]);
        let mirrored = Layout {
            mirrored: true,
            ..WHOLE
        };
        assert_eq!(image(&pixels, &mirrored).millimetres, [3, 2, 1, 6, 5, 4]);
        let padded = Layout {
            row_bytes: 8,
            ..WHOLE
        };
        let with_padding = bytes(&[1, 2, 3, 99, 4, 5, 6, 99]);
        assert_eq!(
            image(&with_padding, &padded).millimetres,
            [1, 2, 3, 4, 5, 6]
        );
        let tenths = Layout {
            unit_um: 100,
            ..WHOLE
        };
        let fine = bytes(&[0, 1, 14, 15, 20_000, 65_535]);
        assert_eq!(image(&fine, &tenths).millimetres, [0, 1, 1, 2, 2000, 6554]);
    }

    #[test]
    fn cropped_and_short_frames_leave_the_rest_empty() {
        let cropped = Layout {
            size: [2, 1],
            origin: [1, 1],
            row_bytes: 4,
            ..WHOLE
        };
        assert_eq!(
            image(&bytes(&[7, 8]), &cropped).millimetres,
            [0, 0, 0, 0, 7, 8]
        );
        assert_eq!(
            image(&bytes(&[7, 8]), &WHOLE).millimetres,
            [7, 8, 0, 0, 0, 0]
        );
        let beyond = Layout {
            size: [9, 9],
            origin: [2, 1],
            row_bytes: 18,
            ..WHOLE
        };
        assert_eq!(
            image(&bytes(&[7; 81]), &beyond).millimetres,
            [0, 0, 0, 0, 0, 7]
        );
        let nothing = Layout {
            size: [0, 2],
            row_bytes: 0,
            ..WHOLE
        };
        assert_eq!(image(&bytes(&[7, 8]), &nothing).millimetres, [0; 6]);
    }
}

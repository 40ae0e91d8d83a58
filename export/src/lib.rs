//! Takes as files that other tools read: the fused people of a take, as joints or as a rig with rotations.

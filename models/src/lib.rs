//! Occlusion models as ONNX files, run by an embedded runtime or by ONNX Runtime where the user has it.

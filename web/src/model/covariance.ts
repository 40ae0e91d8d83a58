// Covariances of joints as ellipsoids. Matrices are symmetric 3x3, given as their upper triangle xx xy xz yy yz zz, m^2.

/** Axes of an ellipsoid: unit vectors as rows, and the standard deviation along each, metres. */
export interface Ellipsoid {
  /** Nine numbers, row i is axis i; right-handed. */
  axes: Float64Array;
  /** Three numbers. */
  sigmas: Float64Array;
}

const SWEEPS = 12;

/**
 * Eigen-decomposition by cyclic Jacobi rotations (Golub and Van Loan, Matrix Computations, 8.5).
 * Gives null when an entry is not finite or a variance is negative beyond rounding.
 */
export function ellipsoid(triangle: ArrayLike<number>, at = 0): Ellipsoid | null {
  const m = new Float64Array(9);
  const source = [0, 1, 2, 1, 3, 4, 2, 4, 5];
  for (let i = 0; i < 9; i++) {
    const value = triangle[at + source[i]!];
    if (value === undefined || !Number.isFinite(value)) return null;
    m[i] = value;
  }
  const v = new Float64Array([1, 0, 0, 0, 1, 0, 0, 0, 1]);
  for (let sweep = 0; sweep < SWEEPS; sweep++) {
    const off = m[1]! ** 2 + m[2]! ** 2 + m[5]! ** 2;
    const diagonal = m[0]! ** 2 + m[4]! ** 2 + m[8]! ** 2;
    if (off <= 1e-24 * diagonal) break;
    rotate(m, v, 0, 1);
    rotate(m, v, 0, 2);
    rotate(m, v, 1, 2);
  }
  return fromEigen(m, v);
}

/** One rotation that zeroes m[p][q]; the columns of v gather the eigenvectors. */
function rotate(m: Float64Array, v: Float64Array, p: number, q: number): void {
  const apq = m[3 * p + q]!;
  if (apq === 0) return;
  const theta = (m[4 * q]! - m[4 * p]!) / (2 * apq);
  const t = (theta >= 0 ? 1 : -1) / (Math.abs(theta) + Math.hypot(theta, 1));
  const c = 1 / Math.hypot(t, 1);
  const s = t * c;
  for (let k = 0; k < 3; k++) {
    const kp = m[3 * k + p]!;
    const kq = m[3 * k + q]!;
    m[3 * k + p] = c * kp - s * kq;
    m[3 * k + q] = s * kp + c * kq;
  }
  for (let k = 0; k < 3; k++) {
    const pk = m[3 * p + k]!;
    const qk = m[3 * q + k]!;
    m[3 * p + k] = c * pk - s * qk;
    m[3 * q + k] = s * pk + c * qk;
    const vp = v[3 * k + p]!;
    const vq = v[3 * k + q]!;
    v[3 * k + p] = c * vp - s * vq;
    v[3 * k + q] = s * vp + c * vq;
  }
}

function fromEigen(m: Float64Array, v: Float64Array): Ellipsoid | null {
  const sigmas = new Float64Array(3);
  const largest = Math.max(m[0]!, m[4]!, m[8]!);
  for (let i = 0; i < 3; i++) {
    const variance = m[4 * i]!;
    if (variance < -1e-6 * Math.abs(largest) - 1e-12) return null;
    sigmas[i] = Math.sqrt(Math.max(variance, 0));
  }
  const axes = new Float64Array(9);
  for (let i = 0; i < 3; i++) for (let k = 0; k < 3; k++) axes[3 * i + k] = v[3 * k + i]!;
  return { axes, sigmas };
}

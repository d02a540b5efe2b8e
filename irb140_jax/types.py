"""Names for array shapes, used in every signature.  n is the number of joints, T of samples."""

import numpy as np
from jaxtyping import Array, Float

Scalar = Float[Array, ""]
Joints = Float[Array, " n"]
JointMatrix = Float[Array, "n n"]
Vec3 = Float[Array, "3"]
Mat3 = Float[Array, "3 3"]
Pose = Float[Array, "4 4"]
Inertials = Float[Array, "n 10"]
Samples = Float[Array, " T"]
JointSamples = Float[Array, "T n"]
JointBatch = Float[Array | np.ndarray, "T n"]  # samples for functions on batches, which take NumPy too

// Column-major 4x4 transforms, as libfranka has them, and quaternions.
#ifndef TRANSFORM_HPP
#define TRANSFORM_HPP

#include <algorithm>
#include <array>
#include <cmath>

#include "fitmac.hpp"

namespace transform {

using Matrix = std::array<double, 16>;

inline fitmac::Vector3 position(const Matrix& t) noexcept { return {t[12], t[13], t[14]}; }

// The largest of the four components is taken from a square root (Shepperd).
inline fitmac::Quaternion orientation(const Matrix& t) noexcept {
  const double xx = t[0], yy = t[5], zz = t[10];
  const std::array<double, 4> squares{1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz,
                                      1 - xx - yy + zz};
  const auto best = std::max_element(squares.begin(), squares.end()) - squares.begin();
  const double s = 2.0 * std::sqrt(squares[best]);  // four times the component
  const double wx = t[6] - t[9], wy = t[8] - t[2], wz = t[1] - t[4];
  const double xy = t[1] + t[4], xz = t[8] + t[2], yz = t[6] + t[9];
  switch (best) {
    case 0: return {s / 4, wx / s, wy / s, wz / s};
    case 1: return {wx / s, s / 4, xy / s, xz / s};
    case 2: return {wy / s, xy / s, s / 4, yz / s};
    default: return {wz / s, xz / s, yz / s, s / 4};
  }
}

inline Matrix from(const double (&p)[3], const double (&q)[4]) noexcept {
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  return {1 - 2 * (y * y + z * z), 2 * (x * y + w * z),     2 * (x * z - w * y),     0,
          2 * (x * y - w * z),     1 - 2 * (x * x + z * z), 2 * (y * z + w * x),     0,
          2 * (x * z + w * y),     2 * (y * z - w * x),     1 - 2 * (x * x + y * y), 0,
          p[0],                    p[1],                    p[2],                    1};
}

}  // namespace transform

#endif  // TRANSFORM_HPP

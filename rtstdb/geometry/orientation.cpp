#include "rtstdb/geometry/orientation.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace rtstdb {
namespace {

/// A double with the rounding error of the operation that computed it: their sum is exact.
struct Exact {
  double value = 0.0, error = 0.0;
};

Exact sum_of(double a, double b) noexcept {
  const double sum = a + b;
  const double of_b = sum - a;
  return {sum, (a - (sum - of_b)) + (b - of_b)};
}

Exact difference_of(float a, float b) noexcept {
  return sum_of(static_cast<double>(a), -static_cast<double>(b));
}

/// The factors are halves of 26 bits and 27 bits, so the products of halves are exact.
Exact product_of(double a, double b) noexcept {
  constexpr double splitter = 134217729.0;  // 2^27 + 1
  const double wide_a = splitter * a, wide_b = splitter * b;
  const double high_a = wide_a - (wide_a - a), high_b = wide_b - (wide_b - b);
  const double low_a = a - high_a, low_b = b - high_b;
  const double product = a * b;
  return {product, low_a * low_b - (((product - high_a * high_b) - low_a * high_b) - high_a * low_b)};
}

/// An exact sum of doubles that do not overlap, by ascending size, without zeros.
template <std::size_t capacity>
class Expansion {
 public:
  std::size_t size() const noexcept { return size_; }
  double operator[](std::size_t i) const noexcept { return parts_[i]; }
  void add(double part) noexcept {
    if (part != 0.0) parts_[size_++] = part;
  }
  int sign() const noexcept { return size_ == 0 ? 0 : parts_[size_ - 1] > 0.0 ? 1 : -1; }
  double estimate() const noexcept {
    double sum = 0.0;
    for (std::size_t i = 0; i < size_; ++i)
      sum += parts_[i];
    return sum;
  }

 private:
  std::array<double, capacity> parts_;  // only the first size_ are set
  std::size_t size_ = 0;
};

template <std::size_t n, std::size_t m>
Expansion<n + m> sum_of(const Expansion<n>& a, const Expansion<m>& b) noexcept {
  Expansion<n + m> sum;
  std::size_t i = 0, k = 0;
  double carry = 0.0;
  while (i < a.size() || k < b.size()) {
    const bool takes_a = k == b.size() || (i < a.size() && std::abs(a[i]) < std::abs(b[k]));
    const Exact step = sum_of(carry, takes_a ? a[i++] : b[k++]);
    sum.add(step.error);
    carry = step.value;
  }
  sum.add(carry);
  return sum;
}

template <std::size_t n>
Expansion<2 * n> product_of(const Expansion<n>& a, double b) noexcept {
  Expansion<2 * n> product;
  double carry = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Exact term = product_of(a[i], b);
    const Exact low = sum_of(carry, term.error);
    product.add(low.error);
    const Exact high = sum_of(term.value, low.value);
    product.add(high.error);
    carry = high.value;
  }
  product.add(carry);
  return product;
}

template <std::size_t n>
Expansion<4 * n> product_of(const Expansion<n>& a, const Exact& b) noexcept {
  return sum_of(product_of(a, b.value), product_of(a, b.error));
}

Expansion<2> expansion_of(const Exact& a) noexcept {
  Expansion<2> expansion;
  expansion.add(a.error);
  expansion.add(a.value);
  return expansion;
}

using ExactVector = std::array<Exact, 3>;

ExactVector difference_of(const glm::vec3& a, const glm::vec3& b) noexcept {
  return {difference_of(a.x, b.x), difference_of(a.y, b.y), difference_of(a.z, b.z)};
}

/// A component of the cross product.
Expansion<16> cross_of(const ExactVector& u, const ExactVector& v, std::size_t axis) noexcept {
  const std::size_t y = (axis + 1) % 3, z = (axis + 2) % 3;
  return sum_of(product_of(expansion_of(u[y]), v[z]),
                product_of(expansion_of({-u[z].value, -u[z].error}), v[y]));
}

int exact_orientation(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c,
                      const glm::vec3& d) noexcept {
  const ExactVector u = difference_of(b, a), v = difference_of(c, a), w = difference_of(d, a);
  const auto term = [&](std::size_t axis) { return product_of(cross_of(u, v, axis), w[axis]); };
  return sum_of(sum_of(term(0), term(1)), term(2)).sign();
}

}  // namespace

OrientedPlane::OrientedPlane(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c) noexcept
    : a_(a), b_(b), c_(c) {
  const glm::dvec3 u = glm::dvec3(b) - glm::dvec3(a), v = glm::dvec3(c) - glm::dvec3(a);
  across_ = glm::cross(u, v);
  products_ = {std::abs(u.y * v.z) + std::abs(u.z * v.y), std::abs(u.z * v.x) + std::abs(u.x * v.z),
               std::abs(u.x * v.y) + std::abs(u.y * v.x)};
  // The terms of a component of a needle's normal nearly cancel, so rounding would turn the plane.
  const glm::dvec3 size = glm::abs(across_);
  const double largest = std::max({size.x, size.y, size.z});
  glm::dvec3 precise = across_;
  if (!(largest > 1e-2 * std::max({products_.x, products_.y, products_.z}))) {
    const ExactVector exact_u = difference_of(b, a), exact_v = difference_of(c, a);
    for (int axis = 0; axis < 3; ++axis)
      precise[axis] = cross_of(exact_u, exact_v, static_cast<std::size_t>(axis)).estimate();
  }
  twice_area_ = glm::length(precise);
  if (twice_area_ > 0.0) normal_ = precise / twice_area_;
}

int OrientedPlane::side_of(const glm::vec3& d) const noexcept {
  // Shewchuk's bound is 7.0 * 2^-53 of the sum of the sizes of all terms.
  constexpr double unit = 16.0 * 0x1p-53;
  const glm::dvec3 w = glm::dvec3(d) - glm::dvec3(a_);
  const double product = glm::dot(across_, w);
  const double bound = unit * glm::dot(products_, glm::abs(w));
  if (product > bound) return 1;
  if (product < -bound) return -1;
  return exact_orientation(a_, b_, c_, d);
}

double OrientedPlane::height_m(const glm::dvec3& d) const noexcept {
  return glm::dot(normal_, d - glm::dvec3(a_));
}

}  // namespace rtstdb

#include "runtime/modules/laser_scanner/target_list.hpp"

namespace hil::modules {

void TargetList::add(const Target& target) noexcept {
  ++found_;
  std::size_t place = kept_;
  while (place > 0 && targets_[place - 1].intensity_per_m2 < target.intensity_per_m2)
    --place;
  if (place == capacity_) return;
  if (kept_ < capacity_) ++kept_;
  for (std::size_t k = kept_ - 1; k > place; --k)
    targets_[k] = targets_[k - 1];
  targets_[place] = target;
}

}  // namespace hil::modules

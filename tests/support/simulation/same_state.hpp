#pragma once
// Compares rows bit for bit.

#include <rtstdb/entity.hpp>

#include "rtstdb/store/motion_words.hpp"

namespace hil::tests {

inline bool same_state(const rtstdb::EntityState& a, const rtstdb::EntityState& b) {
  const rtstdb::EntityRow &x = a.row, &y = b.row;
  return a.id == b.id && a.written_by == b.written_by && x.geometry == y.geometry && x.scale == y.scale &&
         x.mask == y.mask && x.material == y.material && x.light == y.light &&
         rtstdb::store::words_of(x.motion) == rtstdb::store::words_of(y.motion);
}

}  // namespace hil::tests

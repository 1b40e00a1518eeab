#pragma once
// What the lists of the record's keys share (record_fields.hpp).

#include <concepts>
#include <type_traits>

namespace hil::report {

/// T is U or const U: one function serves reader and writer.
template <class T, class U>
concept Is = std::same_as<std::remove_const_t<T>, U>;

}  // namespace hil::report

#pragma once
// Judges answers of every query kind with one function, from rtstdb/query_kinds.def.

#include <span>

#include "rtstdb/oracle/oracle.hpp"

namespace rtstdb::oracle {

// Judges the answer to one element of a query with these options. `of_element`: one answer, or hits_per_ray
// hits of a ray, or returns_per_cone returns of a cone. Of a query that only counts, lists are empty.
#define QUERY_KIND(kind, Class, Element, elements, Answer, answers, ...)                          \
  Judgement judge(const World& world, const Element& element, std::span<const Answer> of_element, \
                  const Class##Options& options);
#include <rtstdb/query_kinds.def>
#undef QUERY_KIND

}  // namespace rtstdb::oracle

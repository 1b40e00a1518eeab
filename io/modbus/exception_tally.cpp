#include "io/modbus/exception_tally.hpp"

namespace hil::io::modbus {

namespace {

/// Never 0.
std::uint64_t packed(const RequestRange& range) noexcept {
  return std::uint64_t{1} << 48U | std::uint64_t{range.writes} << 40U |
         std::uint64_t{static_cast<std::uint8_t>(range.table)} << 32U | std::uint64_t{range.address} << 16U |
         range.count;
}

RequestRange unpacked(std::uint64_t bits) noexcept {
  return {.writes = (bits >> 40U & 1U) != 0,
          .table = static_cast<Table>(bits >> 32U & 0xFFU),
          .address = static_cast<std::uint16_t>(bits >> 16U & 0xFFFFU),
          .count = static_cast<std::uint16_t>(bits & 0xFFFFU)};
}

}  // namespace

std::string_view exception_name(std::size_t code) noexcept {
  constexpr std::array<std::string_view, 12> names{"",
                                                   "illegal function",
                                                   "illegal data address",
                                                   "illegal data value",
                                                   "unit failure",
                                                   "acknowledged, still working",
                                                   "unit busy",
                                                   "negative acknowledgement",
                                                   "memory parity error",
                                                   "undefined",
                                                   "gateway path unavailable",
                                                   "the unit behind the gateway does not answer"};
  return names[code < names.size() ? code : 0];
}

void ExceptionTally::add(std::size_t code, const std::optional<RequestRange>& range) noexcept {
  if (code == 0 || code >= counts_.size()) return;
  if (counts_[code].fetch_add(1, std::memory_order_relaxed) == 0 && range)
    first_[code].store(packed(*range), std::memory_order_relaxed);
}

ExceptionCounts ExceptionTally::counts() const noexcept {
  ExceptionCounts counts{};
  for (std::size_t code = 0; code < counts.size(); ++code)
    counts[code] = counts_[code].load(std::memory_order_relaxed);
  return counts;
}

FirstRefusedRequests ExceptionTally::first_requests() const noexcept {
  FirstRefusedRequests requests;
  for (std::size_t code = 0; code < requests.size(); ++code) {
    if (const std::uint64_t bits = first_[code].load(std::memory_order_relaxed); bits != 0)
      requests[code] = unpacked(bits);
  }
  return requests;
}

}  // namespace hil::io::modbus

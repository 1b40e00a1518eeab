#include "io/modbus/request_plan.hpp"

#include <algorithm>

#include "io/modbus/require.hpp"

namespace hil::io::modbus {

namespace {

std::uint32_t limit_of(Table table, Access access) {
  if (is_bit_table(table)) return access == Access::read ? max_bits_read : max_bits_written;
  return access == Access::read ? max_registers_read : max_registers_written;
}

}  // namespace

std::vector<PlannedRequest> plan_requests(const RegisterMap& map, std::span<const std::size_t> chosen,
                                          Access access, std::uint16_t max_gap) {
  std::vector<std::size_t> sorted(chosen.begin(), chosen.end());
  for (const std::size_t index : sorted)
    require(index < map.entries.size(), "plan_requests: no such entry");
  std::sort(sorted.begin(), sorted.end(), [&](std::size_t a, std::size_t b) {
    const RegisterEntry& left = map.entries[a];
    const RegisterEntry& right = map.entries[b];
    return left.table != right.table ? left.table < right.table : left.address < right.address;
  });
  const std::uint32_t gap_limit = access == Access::read ? max_gap : 0;

  // A greedy fill from the left is optimal, since entries are indivisible and do not overlap.
  std::vector<PlannedRequest> requests;
  for (const std::size_t index : sorted) {
    const RegisterEntry& entry = map.entries[index];
    const std::uint32_t end = std::uint32_t{entry.address} + width_of(entry.type);
    if (!requests.empty()) {
      PlannedRequest& last = requests.back();
      const std::uint32_t last_end = std::uint32_t{last.address} + last.count;
      if (last.table == entry.table && entry.address <= last_end + gap_limit &&
          end - last.address <= limit_of(entry.table, access)) {
        last.count = static_cast<std::uint16_t>(end - last.address);
        last.entries.push_back(index);
        continue;
      }
    }
    requests.push_back({entry.table, entry.address, width_of(entry.type), {index}});
  }
  return requests;
}

}  // namespace hil::io::modbus

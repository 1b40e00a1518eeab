#pragma once
// The registers of a Modbus server: four tables with the extent of a register map, and the addresses that
// clients may write.
//
// A table extends from its lowest to its highest mapped address. Unmapped addresses in between read as 0, so
// that clients may read across them, and can not be written.
//
// Threads: one at a time.

#include <modbus/modbus.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "io/modbus/register_codec.hpp"
#include "io/modbus/register_map.hpp"

namespace hil::io::modbus {

class RegisterBank {
 public:
  /// Every entry starts at its safe value. `client_writes[i]`: clients may write entry i, which is then a
  /// coil or a holding register. Misuse (asserts): a size that differs from the map's; another table.
  RegisterBank(const RegisterMap& map, const std::vector<bool>& client_writes);

  /// Whether the table contains the whole range.
  bool readable(Table table, std::uint32_t address, std::uint32_t count) const noexcept;
  /// Whether clients may write the whole range.
  bool writable(Table table, std::uint32_t address, std::uint32_t count) const noexcept;

  /// An entry whose registers hold a value outside its range or no finite number.
  struct OutOfRange {
    std::size_t entry = 0;  ///< index into the map
    double value = 0.0;
  };
  /// The first such entry among those that clients may write and that overlap these addresses; empty: none.
  std::optional<OutOfRange> out_of_range(Table table, std::uint32_t address,
                                         std::uint32_t count) const noexcept;

  Conversion store(const RegisterEntry& entry, double value) noexcept;
  Decoded load(const RegisterEntry& entry) const noexcept;

  /// Sets one address; bits are 0 or 1. Misuse (asserts): an address outside the table.
  void set(Table table, std::uint16_t address, std::uint16_t value) noexcept;
  std::uint16_t get(Table table, std::uint16_t address) const noexcept;

  /// For modbus_reply.
  modbus_mapping_t* mapping() noexcept { return mapping_.get(); }

 private:
  struct Extent {
    std::uint32_t first = 0;
    std::uint32_t count = 0;
  };
  struct FreeMapping {
    void operator()(modbus_mapping_t* mapping) const noexcept { modbus_mapping_free(mapping); }
  };

  const Extent& extent(Table table) const noexcept { return extents_[static_cast<std::size_t>(table)]; }

  Extent extents_[4];
  std::vector<bool> writable_[4];  ///< per address of the table
  struct ClientEntry {
    std::size_t index = 0;
    RegisterEntry entry;
  };
  std::vector<ClientEntry> client_entries_;  ///< the entries that clients may write
  std::unique_ptr<modbus_mapping_t, FreeMapping> mapping_;
};

}  // namespace hil::io::modbus

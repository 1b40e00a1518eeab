#include "runtime/modules/recorded_field.hpp"

namespace hil::modules {

rtstdb::FieldOptions field_options_of(const contribution::FieldRecord& record) {
  rtstdb::FieldOptions options{
      .error_m = record.error_m, .cell_m = record.cell_m, .max_bytes = record.max_bytes};
  using rtstdb::FieldSign;
  for (const FieldSign sign : {FieldSign::winding, FieldSign::ray_ratio, FieldSign::none})
    if (record.sign == rtstdb::to_string(sign)) options.sign = sign;
  return options;
}

}  // namespace hil::modules

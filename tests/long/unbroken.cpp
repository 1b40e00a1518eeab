// The database as it is.

namespace hil::torture {

extern const char* const broken;
const char* const broken = nullptr;

}  // namespace hil::torture

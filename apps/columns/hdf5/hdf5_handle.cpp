#include "hdf5_handle.h"

#include <stdexcept>

namespace holdfast::app {
namespace {

/// The innermost of its errors: what the system said.
herr_t
keepInnermost(unsigned depth, const H5E_error2_t* error, void* text)
{
  if (depth == 0)
    *static_cast<std::string*>(text) = error->desc != nullptr ? error->desc : "";
  return 0;
}

[[noreturn]] void
fail()
{
  std::string cause;
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, keepInnermost, &cause);
  throw std::runtime_error("HDF5: " + (cause.empty() ? "failed" : cause));
}

} // namespace

hid_t
checked(hid_t id)
{
  if (id < 0)
    fail();
  return id;
}

void
checkedCall(herr_t result)
{
  if (result < 0)
    fail();
}

Handle
stringType()
{
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  checkedCall(H5Tset_size(type, H5T_VARIABLE));
  checkedCall(H5Tset_cset(type, H5T_CSET_UTF8));
  return type;
}

} // namespace holdfast::app

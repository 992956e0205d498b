/// \file Handles of HDF5 that close themselves, and its errors as exceptions.
#pragma once

#include <hdf5.h>

#include <string>
#include <utility>

namespace holdfast::app {

/// \throw std::runtime_error with what HDF5 says the cause is, for a negative result.
hid_t checked(hid_t id);
void checkedCall(herr_t result);

/// A file, group, dataset, space, type or list of properties.
class Handle {
public:
  using Close = herr_t (*)(hid_t);

  Handle() = default;

  /// \throw std::runtime_error when `id` is none.
  Handle(hid_t id, Close with) : id_(checked(id)), close_(with) {}

  ~Handle()
  {
    if (id_ >= 0)
      close_(id_);
  }

  Handle(Handle&& other) noexcept
  : id_(std::exchange(other.id_, -1)), close_(other.close_)
  {}

  Handle& operator=(Handle&& other) noexcept
  {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }

  operator hid_t() const
  {
    return id_;
  }

  /// Now rather than in the end, where errors could not be told.
  void close()
  {
    if (id_ >= 0)
      checkedCall(close_(std::exchange(id_, -1)));
  }

private:
  hid_t id_ = -1;
  Close close_ = nullptr;
};

/// Text in UTF-8 of any length.
Handle stringType();

} // namespace holdfast::app

// MATLAB files, as a test writes them.
#pragma once

#include <hdf5.h>
#include <zlib.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

namespace flappy::test {

/// Bytes of version 5 (MathWorks, MAT-File Format): elements of a type, a size and that many bytes.
class MatText {
 public:
  explicit MatText(bool swapped = false) : swapped_(swapped) {
    text = "MATLAB 5.0 MAT-file, by a test";
    text.resize(124, ' ');
    std::memset(text.data() + 116, 0, 8);
    text += swapped ? std::string("\x01\x00MI", 4) : std::string("\x00\x01IM", 4);
  }
  MatText& add(const std::string& element) {
    text += element;
    return *this;
  }

  template <class T>
  std::string bytes(T value) const {
    std::string raw(sizeof(T), '\0');
    std::memcpy(raw.data(), &value, sizeof(T));
    return swapped_ ? std::string(raw.rbegin(), raw.rend()) : raw;
  }
  std::string element(std::uint32_t type, const std::string& content) const {
    return bytes(type) + bytes(static_cast<std::uint32_t>(content.size())) + content +
           std::string(-content.size() % 8, '\0');
  }
  /// A matrix of a class, its sizes and what follows its name.
  std::string matrix(const std::string& name, std::uint32_t flags, const std::vector<std::int32_t>& sizes,
                     const std::string& rest) const {
    std::string dims;
    for (const std::int32_t size : sizes) dims += bytes(size);
    return element(14, element(6, bytes(flags) + bytes(std::uint32_t{0})) + element(5, dims) + element(1, name) + rest);
  }
  std::string doubles(const std::string& name, const std::vector<std::int32_t>& sizes,
                      const std::vector<double>& values, std::uint32_t flags = 6) const {
    std::string raw;
    for (const double v : values) raw += bytes(v);
    return matrix(name, flags, sizes, element(9, raw));
  }
  std::string column(const std::string& name, const std::vector<double>& values) const {
    return doubles(name, {static_cast<std::int32_t>(values.size()), 1}, values);
  }
  /// An array of `count` structs; `fields` are elements without names, those of one struct after the other.
  std::string structs(const std::string& name, std::int32_t count, const std::vector<std::string>& names,
                      const std::vector<std::string>& fields) const {
    std::string list, all;
    for (std::string field : names) {
      field.resize(32);
      list += field;
    }
    for (const std::string& field : fields) all += field;
    return matrix(name, 2, {1, count},
                  bytes(std::uint32_t{4 << 16 | 5}) + bytes(std::int32_t{32}) + element(1, list) + all);
  }
  std::string characters(const std::string& name, const std::string& value) const {
    return matrix(name, 4, {1, static_cast<std::int32_t>(value.size())}, element(16, value));
  }
  std::string object(const std::string& name, const std::string& kind) const {
    return element(14, element(6, bytes(std::uint32_t{17}) + bytes(std::uint32_t{0})) + element(1, name) +
                           element(1, "MCOS") + element(1, kind) +
                           matrix("", 13, {1, 1}, element(6, bytes(0xdd000000u))));
  }
  std::string compressed(const std::string& plain) const {
    uLongf size = compressBound(plain.size());
    std::string packed(size, '\0');
    compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(plain.data()),
             plain.size());
    packed.resize(size);
    return bytes(std::uint32_t{15}) + bytes(static_cast<std::uint32_t>(size)) + packed;
  }

  std::string text;

 private:
  bool swapped_;
};

/// A file of version 7.3, which is HDF5 behind a head of 512 bytes.
class Mat73 {
 public:
  explicit Mat73(std::filesystem::path path) : path_(std::move(path)) {
    const hid_t properties = H5Pcreate(H5P_FILE_CREATE);
    H5Pset_userblock(properties, 512);
    file = H5Fcreate(path_.c_str(), H5F_ACC_TRUNC, properties, H5P_DEFAULT);
    H5Pclose(properties);
  }
  ~Mat73() {
    H5Fclose(file);
    std::string head = "MATLAB 7.3 MAT-file, by a test";
    head.resize(124, ' ');
    std::fstream(path_, std::ios::in | std::ios::out | std::ios::binary) << head << std::string("\x00\x02IM", 4);
  }
  Mat73(const Mat73&) = delete;
  Mat73& operator=(const Mat73&) = delete;

  /// MATLAB fills the attribute's text; others pad it by zeros.
  static void mark(hid_t object, const std::string& kind, H5T_str_t padding = H5T_STR_NULLTERM,
                   const char* attribute = "MATLAB_class") {
    const hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
    H5Tset_size(type, kind.size());
    H5Tset_strpad(type, padding);
    const hid_t made = H5Acreate2(object, attribute, type, space, H5P_DEFAULT, H5P_DEFAULT);
    H5Awrite(made, type, kind.data());
    H5Aclose(made), H5Tclose(type), H5Sclose(space);
  }
  static hid_t group(hid_t in, const char* name) {
    const hid_t made = H5Gcreate2(in, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    mark(made, "struct");
    return made;
  }
  /// An array whose sizes are given as MATLAB has them; in chunks that are packed where `packed`.
  static void add(hid_t in, const char* name, const std::vector<hsize_t>& sizes, const std::vector<double>& values,
                  const std::string& kind = "double", H5T_str_t padding = H5T_STR_NULLTERM, bool packed = false) {
    const std::vector<hsize_t> reversed(sizes.rbegin(), sizes.rend());
    const hid_t space = H5Screate_simple(static_cast<int>(sizes.size()), reversed.data(), nullptr),
                properties = H5Pcreate(H5P_DATASET_CREATE);
    if (packed) {
      H5Pset_chunk(properties, static_cast<int>(sizes.size()), reversed.data());
      H5Pset_deflate(properties, 3);
    }
    const hid_t type = kind == "int16" ? H5T_STD_I16LE : H5T_IEEE_F64LE;
    const hid_t made = H5Dcreate2(in, name, type, space, H5P_DEFAULT, properties, H5P_DEFAULT);
    H5Dwrite(made, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
    mark(made, kind, padding);
    H5Dclose(made), H5Sclose(space), H5Pclose(properties);
  }
  /// A field of an array of structs, which refers to the arrays of these names.
  void refer(hid_t in, const char* name, const std::vector<const char*>& targets) const {
    std::vector<hobj_ref_t> references(targets.size());
    for (std::size_t k = 0; k < targets.size(); ++k) H5Rcreate(&references[k], file, targets[k], H5R_OBJECT, -1);
    const hsize_t count = targets.size();
    const hid_t space = H5Screate_simple(1, &count, nullptr),
                made = H5Dcreate2(in, name, H5T_STD_REF_OBJ, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    H5Dwrite(made, H5T_STD_REF_OBJ, H5S_ALL, H5S_ALL, H5P_DEFAULT, references.data());
    H5Dclose(made), H5Sclose(space);
  }

  hid_t file;

 private:
  std::filesystem::path path_;
};

}  // namespace flappy::test

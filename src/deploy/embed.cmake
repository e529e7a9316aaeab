# Turns text files into one C++ source, a map by their names: cmake -DOUTPUT=x.cpp -DHEADER=x.hpp -DNAMESPACE=a::b -DVARIABLE=kX
# "-DFILES=a;b" -P embed.cmake
set(cpp "#include \"${HEADER}\"\n\nnamespace ${NAMESPACE} {\n\nconst std::map<std::string_view, std::string_view> ${VARIABLE} = {\n")
list(SORT FILES COMPARE FILE_BASENAME)  # by folder, the order would depend on where the project is
foreach(path IN LISTS FILES)
  get_filename_component(name ${path} NAME)
  file(READ ${path} text)
  string(APPEND cpp "{\"${name}\", R\"~~~(${text})~~~\"},\n")
endforeach()
file(WRITE ${OUTPUT} "${cpp}};\n\n}  // namespace ${NAMESPACE}\n")

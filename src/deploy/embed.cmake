# Turns text files into one C++ source: cmake -DOUTPUT=x.cpp "-DFILES=a;b" -P embed.cmake
set(cpp "#include \"deploy/embedded.hpp\"\n\nnamespace flappy::deploy {\n\nconst std::map<std::string_view, std::string_view> kEmbedded = {\n")
foreach(path IN LISTS FILES)
  get_filename_component(name ${path} NAME)
  file(READ ${path} text)
  string(APPEND cpp "{\"${name}\", R\"~~~(${text})~~~\"},\n")
endforeach()
file(WRITE ${OUTPUT} "${cpp}};\n\n}  // namespace flappy::deploy\n")

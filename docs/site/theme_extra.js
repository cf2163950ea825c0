// Debian 12's mkdocs lacks the file of this name that its theme asks for. What is needed of it: tables get the theme's own look.
document.querySelectorAll(".rst-content table").forEach((table) => table.classList.add("docutils"));

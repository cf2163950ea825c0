// Debian 12's mkdocs lacks the file of this name that its theme asks for. What is needed of it: tables get the theme's own look.
document.querySelectorAll(".rst-content table").forEach((table) => table.classList.add("docutils"));

// Lines of code that are too long go on below, but nothing is torn at a hyphen: an option stays one word.
document.querySelectorAll(".rst-content code").forEach((code) => {
    if (code.childElementCount > 0) return;
    const text = code.closest("pre") ? code.textContent : code.textContent.replace(/\s+/g, " ");
    const words = text.split(/(\s+)/);
    code.replaceChildren(...words.map((word) => {
        if (!word.includes("-") || word.length > 60) return word;
        const whole = document.createElement("span");
        whole.style.whiteSpace = "nowrap";
        whole.textContent = word;
        return whole;
    }));
});

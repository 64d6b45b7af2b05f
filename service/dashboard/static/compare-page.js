document.getElementById("comparison").textContent = "";

// The bytes of the GLB. Browsers let a page that was opened from a disk read no files but scripts, so there the GLB comes as one.
export async function loadBytes(file) {
  if (window.location.protocol !== 'file:') {
    const response = await fetch(file);
    if (!response.ok) throw new Error(`${file}: ${response.status} ${response.statusText}`);
    return response.arrayBuffer();
  }
  await new Promise((resolve, reject) => {
    const script = document.createElement('script');
    script.src = `${file}.js`;
    script.onload = resolve;
    script.onerror = () => reject(new Error(`${file}.js is missing beside the page`));
    document.head.append(script);
  });
  return Uint8Array.from(atob(window.REFMESH_GLB), (character) => character.charCodeAt(0)).buffer;
}

import { BufferAttribute, BufferGeometry, RepeatWrapping, SRGBColorSpace, Texture } from "three";

/** One material's triangles of a mesh file. */
export interface MeshPart {
  geometry: BufferGeometry;
  rgba: readonly [number, number, number, number] | null;
  texture: Texture | null;
}

interface Head {
  vertices: number;
  triangles: number;
  rgba: [number, number, number, number] | null;
  /** Bytes of the picture that lies over it, 0 where there is none. */
  image: number;
}

const kept = new Map<string, string>();
const loaded = new Map<string, Promise<MeshPart[]>>();

/** Takes in packed meshes by id, in base64, which then need no server. */
export function keepMeshes(packed: Readonly<Record<string, string>>): void {
  for (const [id, text] of Object.entries(packed)) kept.set(id, text);
}

/** The triangles of a mesh of the scene, fetched once. */
export function mesh(id: string): Promise<MeshPart[]> {
  let parts = loaded.get(id);
  if (parts === undefined) {
    parts = fetchMesh(id);
    loaded.set(id, parts);
    parts.catch(() => loaded.delete(id));
  }
  return parts;
}

async function fetchMesh(id: string): Promise<MeshPart[]> {
  const text = kept.get(id);
  if (text !== undefined) return unpack(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
  const answer = await fetch(`./mesh/${id}${location.search}`);
  if (!answer.ok) throw new Error(`mesh ${id}: ${answer.status}`);
  return unpack(await answer.arrayBuffer());
}

/** The parts of a mesh as the server packs them. */
export function unpack(data: ArrayBuffer): Promise<MeshPart[]> {
  const length = new DataView(data).getUint32(0, true);
  const heads = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length))) as Head[];
  let at = 4 + length;
  const floats = (count: number): Float32Array<ArrayBuffer> => {
    const values = new Float32Array(data, at, count);
    at += values.byteLength;
    return values;
  };
  const parts = heads.map(async (head): Promise<MeshPart> => {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(floats(head.vertices * 3), 3));
    const indices = new Uint32Array(data, at, head.triangles * 3);
    at += indices.byteLength;
    geometry.setIndex(new BufferAttribute(indices, 1));
    geometry.computeVertexNormals();
    if (head.image === 0) return { geometry, rgba: head.rgba, texture: null };
    geometry.setAttribute("uv", new BufferAttribute(floats(head.vertices * 2), 2));
    const image = new Blob([new Uint8Array(data, at, head.image)]);
    at += Math.ceil(head.image / 4) * 4;
    return { geometry, rgba: head.rgba, texture: await painted(image) };
  });
  return Promise.all(parts);
}

async function painted(image: Blob): Promise<Texture> {
  const texture = new Texture(await createImageBitmap(image, { imageOrientation: "flipY" }));
  texture.flipY = false; // a bitmap is turned when it is made
  texture.colorSpace = SRGBColorSpace;
  texture.wrapS = texture.wrapT = RepeatWrapping;
  texture.anisotropy = 4;
  texture.needsUpdate = true;
  return texture;
}
